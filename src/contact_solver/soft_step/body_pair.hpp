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

/// Whether an inverse inertia in world axes is that of a body that does not rotate about an axis.
JFPX_HD inline bool locks_rotation(const Mat3& inertia) {
  return !(inertia(0, 0) > 0 && inertia(1, 1) > 0 && inertia(2, 2) > 0);
}

/// Regular matrix for the response of a relative rotation to angular impulses: about axes of the
/// world that both bodies have locked, it has the mean response about the others. There is no
/// relative rotation about these axes, and impulses about them have no effect.
/// @param response sum of the inverse inertias in world axes
JFPX_HD inline Mat3 regular_response(Mat3 response) {
  const Real x = response(0, 0), y = response(1, 1), z = response(2, 2);
  const int free = (x > 0 ? 1 : 0) + (y > 0 ? 1 : 0) + (z > 0 ? 1 : 0);
  if (free == 3 || free == 0) return response;
  const Real mean = (x + y + z) / static_cast<Real>(free);
  for (int i = 0; i < 3; ++i) {
    if (!(response(i, i) > 0)) response(i, i) = mean;
  }
  return response;
}

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
