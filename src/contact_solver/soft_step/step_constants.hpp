/// Constants of a soft step: softness of contacts, from the settings of a scene.
#pragma once

#include <jfpx/scene.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// Sweeps over the rows per substep: one bias sweep, and relax sweeps without bias.
inline constexpr std::uint32_t kRelaxSweeps = 1, kSweepsPerSubstep = 1 + kRelaxSweeps;

/// Bias sweeps over the rows of joints only, before the bias sweep of a substep over all rows. The
/// impulses of joints change in each substep, and with a single iteration, their errors would add
/// energy to chains.
inline constexpr std::uint32_t kJointSweeps = 3;
/// Largest number of sweeps in the substeps of a step. Many substeps have fewer joint sweeps.
inline constexpr std::uint32_t kMostSweeps = 244;
JFPX_HD constexpr std::uint32_t joint_sweeps(std::uint32_t substeps) {
  const std::uint32_t most = kMostSweeps / substeps - kSweepsPerSubstep;
  return most < kJointSweeps ? most : kJointSweeps;
}
static_assert(joint_sweeps(kMaxSubsteps) > 0, "the first of them turns the impulses of joints");

/// A contact as a damped spring whose coefficients depend on the substep, so that it is stable for
/// every stiffness (Catto, Solver2D, 2023).
struct Softness {
  Real bias_rate = 0;      ///< [1/s], push-out velocity per penetration
  Real mass_scale = 1;     ///< [-], weight of the velocity error
  Real impulse_scale = 0;  ///< [-], fraction of the accumulated impulse that relaxes
};

/// @param hertz   [Hz], frequency of the spring, > 0
/// @param damping [-], damping ratio, > 0
/// @param h       [s], length of a substep
JFPX_HD constexpr Softness make_softness(Real hertz, Real damping, Real h) {
  const Real omega = 2 * kPi * hertz;
  const Real a1 = 2 * damping + h * omega;
  const Real a2 = h * omega * a1;
  const Real a3 = 1 / (1 + a2);
  return {omega / a1, a2 * a3, a3};
}

/// Constants of all contacts of a step.
struct StepConstants {
  Real h = 0;           ///< [s], length of a substep
  Real inverse_h = 0;   ///< [1/s]
  Softness movable;     ///< between two movable bodies
  Softness balls;       ///< between two movable spheres, in a SphereRow
  Softness deep_balls;  ///< between two movable spheres, for deep penetrations
  Softness fixed;       ///< between a movable and an immovable or kinematic body
  /// The same as `movable` and `fixed` for a body with joints, except in a SphereRow.
  Softness jointed, jointed_fixed;
  /// [m/s], push-out by velocity and projection together, and projection of joints
  Real push_out_speed = 0;
  /// [m/s], push-out by velocity. The relax sweep removes most of it from the velocities, but not
  /// all in chains of overlapping bodies, which would fly apart at a higher speed.
  Real max_bias_velocity = 0;
  Real restitution_threshold = 0;  ///< [m/s], slower contacts do not bounce
  /// [1/m], > 0: points with a gap of more than its reciprocal hardly count in the centre of
  /// friction
  Real inverse_friction_gap = 0;
  std::uint32_t joint_sweeps = 0;  ///< per substep, if there are joints
};

/// Factors of the damping ratio between movable spheres. A lower factor lets layers at the bottom
/// of deep heaps creep; a higher factor lets pyramids of boxes oscillate. The second factor pushes
/// out deep penetrations faster, for example of bodies that overlap at the start.
inline constexpr Real kSphereDamping = 6, kDeepSphereDamping = 2;
/// Factor of the damping ratio of other contacts of movable bodies. At a lower factor, a tower of
/// 50 boxes is pressed into itself before its impulses have converged, and heaps of boxes take
/// longer to rest. At a higher one, pyramids of boxes oscillate.
inline constexpr Real kManifoldDamping = 3;
/// [m], smallest reciprocal of StepConstants::inverse_friction_gap.
inline constexpr Real kSmallestGap = Real(1e-6);
/// The push-out by velocity is limited to the push-out speed divided by this value.
inline constexpr Real kBiasSpeedDivisor = 6;

/// Frequencies are limited to a quarter of the substep rate, and to half of it for fixed bodies:
/// substeps cannot resolve faster springs. For bodies with joints, the limits are half of these. A
/// light foot that carries a heavy body by a joint would vibrate: the contact has the mass of the
/// foot, but its impulses move both.
JFPX_HD constexpr StepConstants make_step_constants(const SoftStepSettings& settings, Real dt) {
  const Real h = dt / static_cast<Real>(settings.substeps);
  const Real inverse_h = static_cast<Real>(settings.substeps) / dt;
  const Real highest = Real(0.25) * inverse_h;
  const bool is_set = settings.contact_hertz > 0 && settings.contact_hertz < highest;
  const Real hertz = is_set ? settings.contact_hertz : highest;
  const Real jointed_hertz = hertz < highest / 2 ? hertz : highest / 2;
  return {
      h,
      inverse_h,
      make_softness(hertz, kManifoldDamping * settings.damping_ratio, h),
      make_softness(hertz, kSphereDamping * settings.damping_ratio, h),
      make_softness(hertz, kDeepSphereDamping * settings.damping_ratio, h),
      make_softness(2 * hertz, settings.damping_ratio, h),
      make_softness(jointed_hertz, kManifoldDamping * settings.damping_ratio, h),
      make_softness(2 * jointed_hertz, settings.damping_ratio, h),
      settings.push_out_speed,
      settings.push_out_speed / kBiasSpeedDivisor,
      settings.restitution_threshold,
      1 / (settings.speculative_margin > kSmallestGap ? settings.speculative_margin : kSmallestGap),
      joint_sweeps(settings.substeps)};
}

/// Part of a row that has no parts.
struct NoPart {};

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

/// Velocities of a body without the contact impulses of the current substep, after its
/// accelerations. The next substep adds the change by contacts again, as a warm start. A rebound
/// also changes these velocities, so that it is not applied again.
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
  Real projection;  ///< [m], >= 0: distance to separate the bodies without changing velocities
};

/// Whether a relax sweep skips a contact. The bias sweep, before positions are integrated, solves a
/// speculative contact (separation > 0). A relax sweep skips speculative contacts without an
/// impulse: otherwise it would push apart bodies that do not touch.
JFPX_HD constexpr bool is_idle(Real separation, Real normal_impulse, bool use_bias) {
  return !use_bias && separation > 0 && !(normal_impulse > 0);
}

/// A speculative contact (separation > 0) may close its gap within the substep. With bias, a
/// penetration is pushed out: by velocity up to max_bias_velocity, and by projection beyond it.
/// @param separation [m] at this substep
JFPX_HD constexpr Bias bias_of(Real separation, const Softness& softness, const StepConstants& step,
                               bool use_bias) {
  if (separation > 0) return {separation * step.inverse_h, 1, 0, 0};
  if (!use_bias) return {0, 1, 0, 0};
  const Real wanted = -softness.bias_rate * separation;
  const Real push = wanted < step.push_out_speed ? wanted : step.push_out_speed;
  const Real velocity = push < step.max_bias_velocity ? push : step.max_bias_velocity;
  return {-velocity, softness.mass_scale, softness.impulse_scale, (push - velocity) * step.h};
}

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
