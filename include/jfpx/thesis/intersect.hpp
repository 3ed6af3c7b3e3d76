/// Conservative early-out tests before collide() (the intersection tester of thesis 4.4.5). If
/// may_touch() returns false, collide() with the same arguments finds no contact, including its
/// rounding (errata E15, E15b, E57): the margins are several times the rounding errors of both.
#pragma once

#include <jfpx/collide.hpp>

namespace jfpx {
inline namespace JFPX_ABI {

/// [m], upper bound of the rounding errors of heights and lengths of this size.
JFPX_HD constexpr Real rounding_margin(Real size) { return 32 * kEpsilon * size; }
/// Sum of the absolute values of the coordinates.
JFPX_HD inline Real largest_sum(const Vec3& v) {
  return absolute(v.x) + absolute(v.y) + absolute(v.z);
}

/// Equals the test of collide(), which is no more expensive.
JFPX_HD constexpr bool may_touch(const SphereInstance& sphere, const HalfSpace& half_space) {
  return (dot(half_space.normal, sphere.centre) - half_space.offset) - sphere.radius <= 0;
}
JFPX_HD constexpr bool may_touch(const SphereInstance& sphere, const Plane& plane) {
  const Real height = dot(plane.normal, sphere.centre) - plane.offset;
  return (height < 0 ? -height : height) - sphere.radius <= 0;
}

/// Tests the bounding sphere of the box.
JFPX_HD inline bool may_touch(const SphereInstance& sphere, const Box& box, const Transform& pose) {
  const Real sum = sphere.radius + length(box.half_extents);
  const Real limit = sum + rounding_margin(sum);
  return !(length_squared(sphere.centre - pose.origin) > limit * limit);
}

/// Projects the box onto the normal.
JFPX_HD inline bool may_touch(const Box& box, const Transform& pose, const HalfSpace& half_space) {
  const Vec3 local = transform_transpose(pose.basis, half_space.normal);
  const Vec3 magnitude{absolute(local.x), absolute(local.y), absolute(local.z)};
  const Real height = dot(half_space.normal, pose.origin) - half_space.offset;
  const Real size =
      largest_sum(pose.origin) + largest_sum(box.half_extents) + absolute(half_space.offset);
  return !(height - dot(magnitude, box.half_extents) > rounding_margin(size));
}
JFPX_HD inline bool may_touch(const Box& box, const Transform& pose, const Plane& plane) {
  const bool behind = dot(plane.normal, pose.origin) < plane.offset;
  return behind ? may_touch(box, pose, HalfSpace{-plane.normal, -plane.offset})
                : may_touch(box, pose, HalfSpace{plane.normal, plane.offset});
}

/// Tests the bounding sphere of each box against the other box, along the axes of that box.
JFPX_HD inline bool may_touch(const Box& a, const Transform& pose_a, const Box& b,
                              const Transform& pose_b) {
  const Vec3 between = pose_b.origin - pose_a.origin;
  const Real radius_a = length(a.half_extents), radius_b = length(b.half_extents);
  const Real margin = rounding_margin(radius_a + radius_b + largest_sum(between));
  const Vec3 in_a = transform_transpose(pose_a.basis, between);
  const Vec3 in_b = transform_transpose(pose_b.basis, between);
  for (int i = 0; i < 3; ++i) {
    if (absolute(in_a[i]) - a.half_extents[i] - radius_b > margin) return false;
    if (absolute(in_b[i]) - b.half_extents[i] - radius_a > margin) return false;
  }
  return true;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
