/// Pair tests between a sphere and the shapes that it can meet, as pure functions for host and
/// device. Sphere against sphere is the collider's (sphere_collider.hpp).
#pragma once

#include <jfpx/shape.hpp>

namespace jfpx::inline JFPX_ABI {

/// How a sphere touches a solid. Without a touch the other fields are 0.
struct Touch {
  bool touching = false;
  Vec3 normal;        ///< [-], unit, from the solid to the sphere
  Vec3 point;         ///< [m], world, the middle of the overlap
  Real distance = 0;  ///< [m], <= 0: minus the penetration
  friend bool operator==(const Touch&, const Touch&) = default;
};

/// The touch that follows from its normal and distance.
JFPX_HD constexpr Touch make_touch(const SphereInstance& sphere, const Vec3& normal,
                                   Real distance) {
  return {true, normal, sphere.centre - normal * (sphere.radius + distance * Real(0.5)), distance};
}

/// Touching counts, however deep the sphere is inside.
JFPX_HD constexpr Touch collide(const SphereInstance& sphere, const HalfSpace& half_space) {
  const Real distance = (dot(half_space.normal, sphere.centre) - half_space.offset) - sphere.radius;
  if (!(distance <= 0)) return {};
  return make_touch(sphere, half_space.normal, distance);
}

/// The nearest point of the box decides (Ericson 2005, 5.2.5). A centre on or inside the box has
/// none that gives a direction: there the face of least depth does, x before y before z (E9).
JFPX_HD inline Touch collide(const SphereInstance& sphere, const Box& box, const Transform& pose) {
  const Vec3 local = transform_transpose(pose.basis, sphere.centre - pose.origin);
  Vec3 outside;
  for (int i = 0; i < 3; ++i) {
    const Real h = box.half_extents[i];
    outside[i] = local[i] > h ? local[i] - h : local[i] < -h ? local[i] + h : Real(0);
  }
  const Real gap = length(outside);
  if (!(gap <= sphere.radius)) return {};
  if (gap > kEpsilon) {
    return make_touch(sphere, pose.basis * (outside * (Real(1) / gap)), gap - sphere.radius);
  }
  int face = 0;
  Vec3 depth;
  for (int i = 0; i < 3; ++i) {
    depth[i] = box.half_extents[i] - absolute(local[i]);
    if (depth[i] < depth[face]) face = i;
  }
  const Vec3 axis = pose.basis.column(face);
  return make_touch(sphere, local[face] < 0 ? -axis : axis, -(sphere.radius + depth[face]));
}

}  // namespace jfpx::inline JFPX_ABI
