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

/// The equation of momentum_keeping_change().
struct MomentumEquation {
  const Mat3& inertia;
  Real half, quarter2;  ///< dt / 2, dt^2 / 4

  /// The part that is quadratic in an angular velocity. @param side 1: after the step; -1: before
  JFPX_HD Vec3 quadratic(const Vec3& w, const Vec3& momentum, Real side) const {
    return w * (dot(w, momentum) * quarter2) + cross(w, momentum) * (half * side);
  }
  JFPX_HD Mat3 slope(const Vec3& w, const Vec3& momentum) const {
    Mat3 slope =
        inertia + (skew_symmetric(w) * inertia + skew_symmetric(momentum) * Real(-1)) * half;
    const Real twice_energy = dot(w, momentum);
    for (int k = 0; k < 3; ++k) {
      slope.row[k] += momentum * (2 * quarter2 * w[k]);
      slope.row[k][k] += twice_energy * quarter2;
    }
    return slope;
  }
};

/// Limits of the rate of convergence of the fixed-point iterations below, squared: up to the first
/// one, two iterations converge to rounding; up to the second one, three.
inline constexpr Real kSlowerRotation = Real(3e-5), kSlowRotation = Real(3e-4);

/// Change of the angular velocity between two steps of a rotation without torque, in body axes.
/// With integrated_orientation(), which rotates by a Cayley map, the angular momentum is constant
/// and the energy oscillates without a drift: the variational integrator of Bou-Rabee and Marsden
/// (Hamilton-Pontryagin Integrators on Lie Groups, 2009). Iterations start with the angular
/// velocity of the last step, and their number depends on the rotation in a step: fixed-point
/// iterations of a slow rotation, and Newton's method. Up to 0.3 rad in a step, they converge to
/// rounding; at 1 rad, errors are some per cent.
/// @param w       [rad/s], angular velocity of the last step, in body axes
/// @param inertia in body axes, up to a common factor
/// @param inverse of the inertia, up to a common factor
/// @param change  receives the change
/// @returns false if rounding has made the equation singular
JFPX_HD inline bool momentum_keeping_change(const Vec3& w, const Mat3& inertia, const Mat3& inverse,
                                            Real dt, Vec3* change) {
  const Real turned2 = length_squared(w) * dt * dt;
  const Real half = dt * Real(0.5);
  const MomentumEquation equation{inertia, half, half * half};
  const Vec3 momentum = inertia * w;
  const Vec3 before = equation.quadratic(w, momentum, -1);
  *change = {};
  Vec3 now = w, of_now = momentum;

  // A fixed-point iteration multiplies the error by less than w dt, or by (w dt)^2 times the
  // largest moment of inertia divided by the smallest one.
  const Real factor = Real(1) / dot(inertia.row[0], inverse.column(0));
  const Real rate2 = turned2 * (inverse(0, 0) + inverse(1, 1) + inverse(2, 2)) * factor;
  if (rate2 >= 0 && rate2 <= kSlowRotation) {
    for (int left = rate2 > kSlowerRotation ? 3 : 2;;) {
      *change = inverse * ((before - equation.quadratic(now, of_now, 1)) * factor);
      if (--left == 0) return true;
      now = w + *change;
      of_now = inertia * now;
    }
  }

  // With two or three iterations, the error of a slow rotation is below (w dt)^7 or ^15.
  constexpr Real kFast = Real(1e-2), kVeryFast = Real(0.04);
  const int iterations = turned2 > kVeryFast ? 8 : turned2 > kFast ? 3 : 2;
  for (int i = 0; i < iterations; ++i) {
    const Vec3 error = inertia * *change + (equation.quadratic(now, of_now, 1) - before);
    Mat3 inverse_slope;
    if (!invert(equation.slope(now, of_now), &inverse_slope)) return false;
    *change -= inverse_slope * error;
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
