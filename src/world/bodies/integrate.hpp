/// Integration of one rigid body over one step (thesis 4.4.2).
#pragma once

#include <jfpx/math.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Velocity after a step: accelerated, then damped once (erratum E18). `kept` is damping^dt.
JFPX_HD constexpr Vec3 integrated_velocity(const Vec3& velocity, const Vec3& acceleration, Real dt,
                                           Real kept) {
  return add_scaled(velocity, acceleration, dt) * kept;
}

/// Position after a step at the new velocity: semi-implicit Euler.
JFPX_HD constexpr Vec3 integrated_position(const Vec3& position, const Vec3& velocity, Real dt) {
  return add_scaled(position, velocity, dt);
}

JFPX_HD inline Quat integrated_orientation(const Quat& orientation, const Vec3& angular_velocity,
                                           Real dt) {
  return normalized(add_scaled(orientation, angular_velocity, dt));
}

/// Change of the angular velocity, in body axes, by the gyroscopic term of a step: with unequal
/// moments of inertia, it precesses about the angular momentum. One Newton step of the implicit
/// equation (Catto, Numerical Methods, GDC 2015), which never gains energy, whereas the explicit
/// term is unstable.
/// @param w       angular velocity in body axes
/// @param inertia in body axes, up to a common factor
/// @param change  receives the change
/// @returns false if rounding has made the equation singular
JFPX_HD inline bool gyroscopic_change(const Vec3& w, const Mat3& inertia, Real dt, Vec3* change) {
  const Vec3 momentum = inertia * w;
  const Mat3 slope = skew_symmetric(w) * inertia + skew_symmetric(momentum) * Real(-1);
  Mat3 inverse;
  if (!invert(inertia + slope * dt, &inverse)) return false;
  *change = -(inverse * (cross(w, momentum) * dt));
  return true;
}

/// Change of the angular velocity between two steps of a rotation without torque, in body axes.
/// With integrated_orientation(), which rotates by a Cayley map, the angular momentum is constant
/// and the energy oscillates without a drift: the variational integrator of Bou-Rabee and Marsden
/// (Hamilton-Pontryagin Integrators on Lie Groups, 2009). Newton's method starts with the angular
/// velocity of the last step; the number of iterations depends on the rotation in a step.
/// Up to 0.3 rad in a step, it converges to rounding; at 1 rad, errors are some per cent.
/// @param w       [rad/s], angular velocity of the last step, in body axes
/// @param inertia in body axes, up to a common factor
/// @param change  receives the change
/// @returns false if rounding has made the equation singular
JFPX_HD inline bool momentum_keeping_change(const Vec3& w, const Mat3& inertia, Real dt,
                                            Vec3* change) {
  // With one, two or three iterations, the error of a slow rotation is below (w dt)^3, ^7 or ^15.
  constexpr Real kSlow = Real(1e-5), kFast = Real(1e-2), kVeryFast = Real(0.04);
  const Real turned2 = length_squared(w) * dt * dt;
  const int iterations = turned2 > kVeryFast ? 8 : turned2 > kFast ? 3 : turned2 > kSlow ? 2 : 1;
  const Real half = dt * Real(0.5), quarter2 = half * half;
  const Vec3 momentum = inertia * w;
  const Vec3 before = w * (dot(w, momentum) * quarter2) - cross(w, momentum) * half;
  *change = {};
  Vec3 now = w, of_now = momentum;
  for (int i = 0; i < iterations; ++i) {
    const Real twice_energy = dot(now, of_now);
    const Vec3 after = now * (twice_energy * quarter2) + cross(now, of_now) * half;
    const Vec3 error = inertia * *change + (after - before);
    Mat3 slope =
        inertia + (skew_symmetric(now) * inertia + skew_symmetric(of_now) * Real(-1)) * half;
    for (int k = 0; k < 3; ++k) {
      slope.row[k] += of_now * (2 * quarter2 * now[k]);
      slope.row[k][k] += twice_energy * quarter2;
    }
    Mat3 inverse;
    if (!invert(slope, &inverse)) return false;
    *change -= inverse * error;
    now = w + *change;
    of_now = inertia * now;
  }
  return true;
}

/// Angular velocity after the gyroscopic term of a step.
/// @param axes axes of the body, as columns
JFPX_HD inline Vec3 precessed(const Vec3& angular_velocity, const Mat3& inertia, const Mat3& axes,
                              Real dt) {
  const Vec3 w = transform_transpose(axes, angular_velocity);
  Vec3 change;
  return gyroscopic_change(w, inertia, dt, &change) ? axes * (w + change) : angular_velocity;
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
