/// Speculative contacts: pairs of shapes that touch, that are closer than a margin, or that meet
/// during a step. One of the shapes moves along a straight line relative to the other.
#pragma once

#include "src/collide/box_pair.hpp"
#include "src/collide/sphere_pair.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// A contact along one normal. If the shapes meet during the step, it is that of the time of
/// impact: the gap along its normal closes when they meet, and a pair that passes by has none.
struct SpeculativeContact {
  bool found = false;
  Vec3 normal;        ///< unit, from b to a
  Real distance = 0;  ///< [m], gap at the start of the step along the normal; <= 0: penetration
};

/// Two spheres. Contacts at the start of the step have the arithmetic of SphereCollider.
/// @param motion [m], of a relative to b during the step
/// @param margin [m], >= 0
JFPX_HD inline SpeculativeContact find_speculative(const SphereInstance& a, const SphereInstance& b,
                                                   const Vec3& motion, Real margin) {
  const PairResult now = test_sphere_pair(a, b, margin);
  if (now.touching != 0) return {true, now.normal, now.distance};
  const Vec3 d = a.centre - b.centre;
  const Real closing = -dot(d, motion);
  if (!(closing > 0)) return {};
  // |d + motion * t| = sum, the smaller root in the form without cancellation.
  const Real sum = a.radius + b.radius, len = length(d);
  const Real excess = (len - sum) * (len + sum);
  const Real discriminant = closing * closing - length_squared(motion) * excess;
  if (!(discriminant >= 0)) return {};
  const Real t = excess / (closing + square_root(discriminant));
  if (!(t <= 1)) return {};
  const Vec3 normal = normalized(add_scaled(d, motion, t));
  return {true, normal, -t * dot(motion, normal)};
}

/// Largest number of steps of a conservative advancement.
inline constexpr int kMaxAdvances = 16;

/// The closest points of a sphere's centre and a box.
struct BoxDistance {
  Vec3 normal;        ///< unit, from the box to the sphere
  Real distance = 0;  ///< [m], between the surfaces
};
/// From the closest point of a box to a point; zero inside. Both in the axes of the box.
JFPX_HD inline Vec3 offset_from_box(const Vec3& point, const Box& box) {
  Vec3 offset;
  for (int i = 0; i < 3; ++i) {
    const Real h = box.half_extents[i];
    offset[i] = point[i] > h ? point[i] - h : point[i] < -h ? point[i] + h : Real(0);
  }
  return offset;
}
/// The arithmetic of collide(sphere, box, pose).
JFPX_HD inline BoxDistance distance_to_box(const Vec3& centre, Real radius, const Box& box,
                                           const Transform& pose) {
  const Vec3 local = transform_transpose(pose.basis, centre - pose.origin);
  const Vec3 outside = offset_from_box(local, box);
  const Real gap = length(outside);
  if (gap > kEpsilon) return {pose.basis * (outside * (Real(1) / gap)), gap - radius};
  int face = 0;
  Vec3 depth;
  for (int i = 0; i < 3; ++i) {
    depth[i] = box.half_extents[i] - absolute(local[i]);
    if (depth[i] < depth[face]) face = i;
  }
  const Vec3 axis = pose.basis.column(face);
  return {local[face] < 0 ? -axis : axis, -(radius + depth[face])};
}

/// A contact of a sphere and a box, with its points of application.
struct SpeculativePoint {
  SpeculativeContact contact;
  Vec3 arm_a, arm_b;  ///< [m], from the centres of the sphere and of the box's body
};

/// A sphere against a box, by conservative advancement (Mirtich 1996).
/// @param motion   [m], of the sphere relative to the box during the step
/// @param origin_b [m], centre of mass of the box's body
JFPX_HD inline SpeculativePoint find_speculative(const SphereInstance& sphere, const Box& box,
                                                 const Transform& pose, const Vec3& motion,
                                                 Real margin, const Vec3& origin_b) {
  Real t = 0;
  Vec3 centre = sphere.centre;
  BoxDistance closest = distance_to_box(centre, sphere.radius, box, pose);
  for (int i = 0; i < kMaxAdvances && closest.distance > margin; ++i) {
    const Real closing = -dot(motion, closest.normal);
    if (!(closing > 0)) return {};
    t += closest.distance / closing;
    if (!(t <= 1)) return {};
    centre = add_scaled(sphere.centre, motion, t);
    closest = distance_to_box(centre, sphere.radius, box, pose);
  }
  const Vec3& n = closest.normal;
  const Real overlap = closest.distance < 0 ? closest.distance : Real(0);
  const Vec3 arm_a = n * -(sphere.radius + overlap * Real(0.5));
  return {{true, n, closest.distance - t * dot(motion, n)}, arm_a, centre + arm_a - origin_b};
}

/// Two boxes, by conservative advancement along axes of separation.
/// @param motion [m], of a relative to b during the step
/// @param manifold receives the points where a has advanced by the part `t` of its motion
/// @returns t, in [0, 1]; -1: no contact
JFPX_HD inline Real find_speculative(const Box& a, const Transform& pose_a, const Box& b,
                                     const Transform& pose_b, const Vec3& motion, Real margin,
                                     Manifold* manifold) {
  Real t = 0;
  Transform pose = pose_a;
  for (int i = 0;; ++i) {
    const BoxPair pair = make_box_pair(a, pose, b, pose_b);
    LeastOverlap least;
    least_overlap(pair, kMaxReal, &least);
    if (least.axis < 0) return -1;  // numbers beyond the range of Real
    if (!(least.distance > margin) || i == kMaxAdvances) {
      *manifold = box_manifold(pair, least, pose, pose_b, margin);
      return manifold->count > 0 ? t : Real(-1);
    }
    const Real closing = -dot(motion, pose_a.basis * least.normal);
    if (!(closing > 0)) return -1;
    t += least.distance / closing;
    if (!(t <= 1)) return -1;
    pose.origin = add_scaled(pose_a.origin, motion, t);
  }
}

/// Removes points that hardly extend the polygon of a manifold: those whose triangle with their
/// neighbors has less than 5 % of the area of the polygon. Where corners of two boxes nearly
/// coincide, clipping gives one to three points, which rounding decides; a corner with three points
/// would be three times as stiff, and a stack that changes between them would not come to rest.
/// The depth is linear in the polygon, so that a removed point is hardly deeper than the others.
JFPX_HD inline void remove_redundant_points(Manifold* manifold) {
  constexpr Real kLeastShare = Real(0.05);
  const auto point = [&](int i) {
    return manifold->points[(i + manifold->count) % manifold->count].point;
  };
  const auto area = [](const Vec3& a, const Vec3& b, const Vec3& c) {
    return length(cross(b - a, c - a));
  };
  Real total = 0;
  for (int i = 2; i < manifold->count; ++i) total += area(point(0), point(i - 1), point(i));
  while (manifold->count > 4) {
    int least = 0;
    Real least_area = kMaxReal;
    for (int i = 0; i < manifold->count; ++i) {
      const Real part = area(point(i - 1), point(i), point(i + 1));
      if (part < least_area) least = i, least_area = part;
    }
    if (!(least_area < kLeastShare * total)) return;
    --manifold->count;
    for (int i = least; i < manifold->count; ++i) manifold->points[i] = manifold->points[i + 1];
  }
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
