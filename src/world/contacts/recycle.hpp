/// Contact recycling (Catto, Box3D, 2026): a contact of two solids with flat faces keeps its normal
/// and its points while the bodies hardly move relative to each other.
///
/// A full test in every step would change the points of a contact, because rounding and small
/// motions decide about the reference face and about nearly coincident corners. Stacks and heaps
/// would not come to rest. Lever arms and normals also keep their world directions, so that a tall
/// stack does not buckle on its soft contacts.
#pragma once

#include "src/contact_solver/soft_step/contact_set.hpp"
#include "src/world/contacts/swept_bounds.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

/// Result of a candidate test: contact points for the solver if the sub-shapes may touch during the
/// step, and points of World::contacts() if they touch at its start.
struct CandidateManifold : detail::PairManifold {
  soft_step::ContactKey key;
  soft_step::TestedPoses tested;
  std::uint32_t hidden = 0;     ///< on a device: bit i if another contact hides the point i
  std::uint32_t is_listed = 0;  ///< on a device: 1 if it is in StepData::hiding
};

/// Prepares a contact of a full test for recycle().
JFPX_HD inline void note_test(const BodyView& bodies, CandidateManifold* found) {
  const std::uint32_t a = found->key.a, b = found->key.b;
  found->tested = {bodies.orientation[a], bodies.orientation[b],
                   bodies.position[a] - bodies.position[b]};
  for (std::uint32_t i = 0; i < found->point_count; ++i) {
    found->points[i].tested_distance = found->points[i].distance;
  }
}

/// Rotation of a body since the last full test.
struct TurnSinceTest {
  Quat turn;
  JFPX_HD TurnSinceTest(const Quat& now, const Quat& tested) : turn(now * conjugate(tested)) {}
  JFPX_HD Vec3 vector() const { return {turn.x, turn.y, turn.z}; }
  /// [rad^2], square of the angle, for small angles.
  JFPX_HD Real squared() const { return 4 * length_squared(vector()); }
  /// Change of a vector by the rotation.
  JFPX_HD Vec3 change_of(const Vec3& arm) const {
    const Vec3 u = vector(), twice = cross(u, arm) * Real(2);
    return twice * turn.w + cross(u, twice);
  }
};

/// Recycles the contact of the last step with the distances at the current poses. The contact turns
/// with a kinematic body b, so that bodies stay on a turntable.
/// @returns false if the contact needs a full test: if a point of it has moved by more than the
///   margin of the sub-shapes relative to the other body, if their relative rotation moves any
///   point by as much, or if a movable body has turned
JFPX_HD inline bool recycle(const SweptBounds& bounds, const Candidate& pair,
                            const soft_step::ManifoldInput& last,
                            const soft_step::PointInput* last_points, CandidateManifold* found) {
  /// [rad], most rotation of a movable body: the normal does not turn with it
  constexpr Real kMostTurn = Real(0.02);
  if (!last.tested.are_set()) return false;
  const BodyView& bodies = bounds.bodies;
  const Quat &turned_a = bodies.orientation[pair.a], &turned_b = bodies.orientation[pair.b];
  Vec3 normal = last.normal;
  found->tested = last.tested;
  const bool is_carried = bodies.is_carrier(pair.b);
  const TurnSinceTest carrier(turned_b, last.tested.orientation_b);
  if (is_carried) {
    normal += carrier.change_of(normal);
    found->tested = {carrier.turn * last.tested.orientation_a, turned_b,
                     last.tested.offset + carrier.change_of(last.tested.offset)};
  }
  const TurnSinceTest a(turned_a, found->tested.orientation_a);
  const TurnSinceTest b(turned_b, found->tested.orientation_b);
  if (!(a.squared() <= kMostTurn * kMostTurn) || !(b.squared() <= kMostTurn * kMostTurn)) {
    return false;
  }
  // No point of the overlap is farther from a point of the contact than the smaller solid is wide.
  const Real most = bounds.distance_margin(pair), width = 2 * bounds.smaller_radius(pair);
  if (!(TurnSinceTest(a.turn, b.turn).squared() * (width * width) <= most * most)) return false;
  const Vec3& position_a = bodies.position[pair.a];
  const Vec3& position_b = bodies.position[pair.b];
  const Vec3 offset = (position_a - position_b) - found->tested.offset;
  for (std::uint32_t i = 0; i < last.count; ++i) {
    soft_step::PointInput point = last_points[last.first + i];
    if (is_carried) {
      point.arm_a += carrier.change_of(point.arm_a);
      point.arm_b += carrier.change_of(point.arm_b);
    }
    const Vec3 change_a = a.change_of(point.arm_a), change_b = b.change_of(point.arm_b);
    const Vec3 moved = offset + (change_a - change_b);
    if (!(length_squared(moved) <= most * most)) {
      found->clear();
      return false;
    }
    point.distance = point.tested_distance + dot(moved, normal);
    const Vec3 on_a = position_a + (point.arm_a + change_a);
    const Vec3 on_b = position_b + (point.arm_b + change_b);
    found->points[i] = point;
    if (point.distance <= 0) {
      found->touches[found->touch_count++] = {(on_a + on_b) * Real(0.5), point.distance};
    }
  }
  found->normal = normal;
  found->point_count = last.count;
  return true;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
