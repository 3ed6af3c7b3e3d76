/// One contact of two spheres in a soft step: warm start and solution, including rebounds.
///
/// The points of application lie on the line of centres, so anchors are multiples of the normal,
/// the normal impulse exerts no torque, and the effective mass is the same for every tangent.
#pragma once

#include "src/contact_solver/soft_step/step_constants.hpp"

#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// Aligned, so that a device reads and writes it in few accesses. A sweep changes only the fields
/// before `normal`, and `restitution`: device::RowSolver::store_sphere_row() writes only these.
struct alignas(4 * sizeof(Real)) SphereRow {
  using Part = NoPart;
  static constexpr bool kReadsRotation = false, kReadsOrientation = false;

  Vec3 friction_impulse;  ///< [N s], on a, in the tangent plane
  /// [N s], on a. Its magnitude is the impulse. The sign bit is set until the bodies have pushed
  /// each other in this step; the impulse of the last step does not count.
  Real normal_impulse = 0;
  Vec3 normal;        ///< from b to a
  Real distance = 0;  ///< [m], at the start of the step
  Real friction = 0;
  Real arm_a = 0, arm_b = 0;               ///< [m], from the centres to the common point
  Real normal_mass = 0, tangent_mass = 0;  ///< [kg]
  Real restitution = 0;                    ///< in [0, 1], plus 2 for each rebound in this step
  std::uint32_t a = 0, b = 0;              ///< bodies; a is movable
};

/// [N s], >= 0, on a.
JFPX_HD inline Real normal_impulse_of(const SphereRow& row) { return absolute(row.normal_impulse); }

/// Whether the bodies have pushed each other in this step.
JFPX_HD inline bool has_pushed(const SphereRow& row) { return !std::signbit(row.normal_impulse); }

/// `kFixed`: body b does not move.
/// @tparam Body has inverse_mass and inverse_inertia
template <bool kFixed, class Body>
JFPX_HD constexpr void set_masses(SphereRow* row, const Body& a, const Body& b) {
  Real linear = a.inverse_mass;
  Real angular = row->arm_a * row->arm_a * a.inverse_inertia;
  if constexpr (!kFixed) {
    linear += b.inverse_mass;
    angular += row->arm_b * row->arm_b * b.inverse_inertia;
  }
  row->normal_mass = 1 / linear;
  row->tangent_mass = 1 / (linear + angular);
}

/// Applies an impulse on a, and the opposite one on b. Only the tangential part exerts a torque.
template <bool kFixed>
JFPX_HD constexpr void apply(const SphereRow& row, const Vec3& impulse, const Vec3& tangential,
                             SolverBody* a, SolverBody* b) {
  const Vec3 twist = cross(tangential, row.normal);
  a->velocity += impulse * a->inverse_mass;
  a->angular_velocity += twist * (row.arm_a * a->inverse_inertia);
  if constexpr (!kFixed) {
    b->velocity -= impulse * b->inverse_mass;
    b->angular_velocity += twist * (row.arm_b * b->inverse_inertia);
  }
}

/// Velocity of a's point of contact relative to b's.
template <bool kFixed>
JFPX_HD constexpr Vec3 relative_velocity(const SphereRow& row, const SolverBody& a,
                                         const SolverBody& b) {
  Vec3 spin = a.angular_velocity * row.arm_a;
  Vec3 velocity = a.velocity;
  if constexpr (!kFixed) {
    spin += b.angular_velocity * row.arm_b;
    velocity -= b.velocity;
  }
  return velocity - cross(spin, row.normal);
}

/// [m], at the time of the sweep.
template <bool kFixed>
JFPX_HD constexpr Real separation_of(const SphereRow& row, const SolverBody& a,
                                     const SolverBody& b) {
  Vec3 shift = a.shift;
  if constexpr (!kFixed) shift -= b.shift;
  return row.distance + dot(shift, row.normal);
}

template <bool kFixed>
JFPX_HD inline void warm_start(const SphereRow& row, SolverBody* a, SolverBody* b) {
  apply<kFixed>(row, row.normal * normal_impulse_of(row) + row.friction_impulse,
                row.friction_impulse, a, b);
}

/// Data of the bodies for impacts, as arrays by body.
struct ImpactBodies {
  const Vec3* acceleration = nullptr;  ///< [m/s^2], of movable bodies in this step
  FreeMotion* free = nullptr;

  JFPX_HD void add(std::uint32_t body, const Vec3& change, const Vec3& spun) const {
    free[body].add(change, spun);
  }
};

/// Maximum number of rebounds of a contact in a step. A light body between heavy bodies collides
/// with them repeatedly; the stored impulses must support the heavy bodies.
inline constexpr int kMaxRebounds = 4;

/// Number of rebounds in this step.
JFPX_HD constexpr int rebounds_of(const SphereRow& row) {
  return static_cast<int>(row.restitution * Real(0.5));
}

/// Makes the bodies rebound if their closing speed exceeds what accelerations and the loss of the
/// stored impulse can cause. The bodies get the velocities after the impact, and positions as if
/// they had moved with these velocities since the impact. The impulse acts once: it is neither
/// stored in the row nor repeated by the next substep, so a body may hit several bodies in a step.
/// @param bodies     ImpactBodies, or a type with the same `acceleration` and add()
/// @param separation [m], at the start of the rest of the motion in the substep
/// @param left       [s], duration of that rest
/// @param velocity   of a's point of contact relative to b's, at the end of the substep
/// @param closing    [m/s], < 0, component of `velocity` along the normal
/// @returns whether the bodies rebound
template <bool kFixed, class Impacts>
JFPX_HD inline bool rebound(SphereRow* at, const StepConstants& step, const Impacts& bodies,
                            Real separation, Real left, const Vec3& velocity, Real closing,
                            SolverBody* a, SolverBody* b) {
  const SphereRow& row = *at;
  const int rebounds = rebounds_of(row);
  if (rebounds == kMaxRebounds) return false;
  Vec3 acceleration = bodies.acceleration[row.a];
  Real largest = length(acceleration);
  if constexpr (!kFixed) {
    acceleration -= bodies.acceleration[row.b];
    largest += length(bodies.acceleration[row.b]);
  }
  if (!(-closing > largest * step.h + normal_impulse_of(row) / row.normal_mass)) return false;
  // Time until the impact; negative for an impact in the past, at most one substep ago.
  Real until = separation / -closing;
  if (until < -step.h) until = -step.h;
  const Real gained = dot(acceleration, row.normal) * (until > 0 ? left - until : left);
  const Real along = (1 + row.restitution - static_cast<Real>(2 * rebounds)) * (gained - closing) *
                     row.normal_mass;
  Vec3 friction = (row.normal * closing - velocity) * row.tangent_mass;
  const Real limit = row.friction * along;
  const Real size2 = length_squared(friction);
  if (size2 > limit * limit) friction *= limit / square_root(size2);

  const Vec3 impulse = row.normal * along + friction, twist = cross(friction, row.normal);
  const auto deflect = [&](std::uint32_t i, SolverBody* body, Real inverse_mass, Real arm) {
    const Vec3 change = impulse * inverse_mass, spun = twist * (arm * body->inverse_inertia);
    body->velocity += change;
    body->angular_velocity += spun;
    body->shift -= change * until;
    bodies.add(i, change, spun);
  };
  deflect(row.a, a, a->inverse_mass, row.arm_a);
  if constexpr (!kFixed) deflect(row.b, b, -b->inverse_mass, row.arm_b);
  at->restitution += 2;
  at->normal_impulse = normal_impulse_of(row);
  return true;
}

/// [-], penetration per smaller radius from which StepConstants::deep_balls applies.
inline constexpr Real kDeepPenetration = Real(0.03);

template <bool kFixed>
JFPX_HD constexpr const Softness& softness_of(const SphereRow& row, const StepConstants& step,
                                              Real separation) {
  if constexpr (kFixed) return step.fixed;
  const Real radius = row.arm_a < row.arm_b ? row.arm_a : row.arm_b;
  return -separation > kDeepPenetration * radius ? step.deep_balls : step.balls;
}

/// One iteration: a rebound, friction within Coulomb's cone, and the impulse along the normal.
/// @param use_bias whether it is a bias sweep, which pushes penetrations out
template <bool kFixed, class Impacts>
JFPX_HD inline void solve(SphereRow* row, SolverBody* a, SolverBody* b, const StepConstants& step,
                          const Impacts& bodies, bool use_bias) {
  const Vec3& n = row->normal;
  const Real impulse_before = normal_impulse_of(*row);
  Real separation = separation_of<kFixed>(*row, *a, *b);
  if (is_idle(separation, impulse_before, use_bias)) return;
  Vec3 velocity = relative_velocity<kFixed>(*row, *a, *b);
  Real closing = dot(velocity, n);
  const Real left = use_bias ? step.h : Real(0);
  if (closing < -step.restitution_threshold && separation + closing * left <= 0 &&
      rebound<kFixed>(row, step, bodies, separation, left, velocity, closing, a, b)) {
    if (separation > 0) return;
    separation = separation_of<kFixed>(*row, *a, *b);
    velocity = relative_velocity<kFixed>(*row, *a, *b);
    closing = dot(velocity, n);
  }
  const Bias bias =
      bias_of(separation, softness_of<kFixed>(*row, step, separation), step, use_bias);

  Vec3 friction = row->friction_impulse - (velocity - n * closing) * row->tangent_mass;
  const Real limit = row->friction * impulse_before;
  const Real size2 = length_squared(friction);
  if (size2 > limit * limit) friction *= limit / square_root(size2);
  const Vec3 tangential = friction - row->friction_impulse;
  row->friction_impulse = friction;

  const Real change = -(row->normal_mass * bias.mass_scale) * (closing + bias.velocity) -
                      bias.impulse_scale * impulse_before;
  const Real wanted = impulse_before + change;
  const Real normal_impulse = wanted > 0 ? wanted : Real(0);
  const Real along = normal_impulse - impulse_before;
  row->normal_impulse = wanted > 0 ? wanted : std::copysign(Real(0), row->normal_impulse);
  apply<kFixed>(*row, n * along + tangential, tangential, a, b);
  if (bias.projection > 0) {
    const Vec3 impulse = n * (bias.projection * row->normal_mass);
    a->shift += impulse * a->inverse_mass;
    if constexpr (!kFixed) b->shift -= impulse * b->inverse_mass;
  }
}

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
