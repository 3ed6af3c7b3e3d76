/// Constants of a soft step: softness of contacts, from the settings of a scene.
#pragma once

#include <jfpx/scene.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// A contact as a damped spring whose coefficients depend on the substep, so that it is stable for
/// every stiffness (Catto, Solver2D, 2023).
struct Softness {
  Real bias_rate = 0;      ///< [1/s], push-out velocity per penetration
  Real mass_scale = 1;     ///< [-], weight of the velocity error
  Real impulse_scale = 0;  ///< [-], part of the accumulated impulse that relaxes
};

/// @param hertz   [Hz], frequency of the spring, >= 0
/// @param damping [-], damping ratio, > 0
/// @param h       [s], length of a substep
JFPX_HD constexpr Softness make_softness(Real hertz, Real damping, Real h) {
  if (!(hertz > 0)) return {0, 1, 0};
  const Real omega = 2 * kPi * hertz;
  const Real a1 = 2 * damping + h * omega;
  const Real a2 = h * omega * a1;
  const Real a3 = 1 / (1 + a2);
  return {omega / a1, a2 * a3, a3};
}

/// Values that all contacts of a step share.
struct StepConstants {
  Real h = 0;               ///< [s], length of a substep
  Real inverse_h = 0;       ///< [1/s]
  Softness movable;         ///< between two movable bodies
  Softness balls;           ///< between two movable spheres, in a SphereRow
  Softness deep_balls;      ///< the same, for penetrations that heaps at rest do not have
  Softness fixed;           ///< between a movable and an immovable or kinematic body
  Real push_out_speed = 0;  ///< [m/s]
  /// [m/s], maximum velocity of a push-out. The sweep without push-out removes most of it from the
  /// velocities, but not all of it in chains of overlapping bodies, which would fly apart at a
  /// higher speed.
  Real soft_speed = 0;
  Real restitution_threshold = 0;  ///< [m/s], slower contacts do not bounce
};

/// Frequencies are limited to a quarter of the substep rate, and twice that for fixed bodies: a
/// faster spring would not be resolved by the substeps. Spheres have six times the damping ratio:
/// with less, layers at the bottom of deep heaps keep creeping, while pyramids of boxes would keep
/// oscillating with more. Deep penetrations, as of bodies that overlap at the start, are pushed out
/// faster with twice the damping ratio.
JFPX_HD constexpr StepConstants make_step_constants(const SoftStepSettings& settings, Real dt) {
  const Real h = dt / static_cast<Real>(settings.substeps);
  const Real inverse_h = static_cast<Real>(settings.substeps) / dt;
  const Real highest = Real(0.25) * inverse_h;
  const bool is_set = settings.contact_hertz > 0 && settings.contact_hertz < highest;
  const Real hertz = is_set ? settings.contact_hertz : highest;
  return {h,
          inverse_h,
          make_softness(hertz, settings.damping_ratio, h),
          make_softness(hertz, 6 * settings.damping_ratio, h),
          make_softness(hertz, 2 * settings.damping_ratio, h),
          make_softness(2 * hertz, settings.damping_ratio, h),
          settings.push_out_speed,
          settings.push_out_speed / 6,
          settings.restitution_threshold};
}

/// Motion of a body during a step, for the rows of its contacts.
struct alignas(16 * sizeof(Real)) SolverBody {
  Vec3 velocity;             ///< [m/s]
  Real inverse_mass = 0;     ///< [1/kg]; 0: immovable or kinematic
  Vec3 angular_velocity;     ///< [rad/s], world axes
  Real inverse_inertia = 0;  ///< [1/(kg m^2)], of a sphere with isotropic inertia, otherwise 0
  Vec3 shift;                ///< [m], translation since the start of the step
  Real unused = 0;
  Vec3 rotation;  ///< [rad], rotation since the start of the step, to first order
  Real unused_too = 0;
};
static_assert(sizeof(SolverBody) == 16 * sizeof(Real));

/// Velocities of a body after the accelerations of a substep and the rebounds since: the rest of
/// its velocities are impulses of contacts, which the next substep applies again.
struct FreeMotion {
  Vec3 velocity, angular_velocity;

  JFPX_HD void add(const Vec3& change, const Vec3& spun) {
    velocity += change;
    angular_velocity += spun;
  }
};

/// Velocity along the normal that a contact must reach, and the weights of its impulse.
struct Bias {
  Real velocity, mass_scale, impulse_scale;
  Real projection;  ///< [m], >= 0: distance by which the bodies are moved apart, without velocity
};

/// Whether a contact takes no part in a sweep: a gap limits the velocity in the soft sweep only,
/// which precedes the motion. In the other sweep of the last substep, it would make bodies rebound
/// before they meet.
JFPX_HD constexpr bool is_idle(Real separation, Real normal_impulse, bool soft) {
  return !soft && separation > 0 && !(normal_impulse > 0);
}

/// A separated contact may close its gap within the substep (speculative contact). If `soft`, a
/// penetration is pushed out: by velocity up to soft_speed, and by projection beyond it.
/// @param separation [m] at this substep
JFPX_HD constexpr Bias bias_of(Real separation, const Softness& softness, const StepConstants& step,
                               bool soft) {
  if (separation > 0) return {separation * step.inverse_h, 1, 0, 0};
  if (!soft) return {0, 1, 0, 0};
  const Real wanted = -softness.bias_rate * separation;
  const Real push = wanted < step.push_out_speed ? wanted : step.push_out_speed;
  const Real velocity = push < step.soft_speed ? push : step.soft_speed;
  return {-velocity, softness.mass_scale, softness.impulse_scale, (push - velocity) * step.h};
}

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
