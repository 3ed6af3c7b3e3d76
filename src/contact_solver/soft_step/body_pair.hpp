/// The two bodies of a row.
#pragma once

#include "src/contact_solver/soft_step/step_constants.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// The bodies of a row, and their inverse inertia in world axes.
struct BodyPair {
  SolverBody *a, *b;
  const Mat3 *inertia_a, *inertia_b;
};

/// Orientations of the bodies of a row at the time of the sweep, and at the start of the step.
struct PairOrientations {
  const Quat *a = nullptr, *b = nullptr;
  const Quat *start_a = nullptr, *start_b = nullptr;
};

/// Velocity of a's point relative to b's. A kinematic body b has a velocity.
JFPX_HD constexpr Vec3 relative_velocity(const BodyPair& pair, const Vec3& arm_a,
                                         const Vec3& arm_b) {
  return (pair.a->velocity + cross(pair.a->angular_velocity, arm_a)) -
         (pair.b->velocity + cross(pair.b->angular_velocity, arm_b));
}

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
