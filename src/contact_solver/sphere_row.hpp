/// One contact of two spheres in a soft step: warm start, solution and restitution.
///
/// The points of application lie on the line of centres, so anchors are multiples of the normal,
/// the normal impulse exerts no torque, and the effective mass is the same for every tangent.
#pragma once

#include "src/contact_solver/step_constants.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// Aligned, so that a device reads and writes it in few accesses; what a sweep changes is adjacent.
struct alignas(4 * sizeof(Real)) SphereRow {
  Vec3 friction_impulse;    ///< [N s], on a, in the tangent plane
  Real normal_impulse = 0;  ///< [N s], on a
  Vec3 normal;              ///< from b to a
  Real distance = 0;        ///< [m], at the start of the step
  Real friction = 0;
  Real arm_a = 0, arm_b = 0;               ///< [m], from the centres to the common point
  Real normal_mass = 0, tangent_mass = 0;  ///< [kg]
  /// [m/s], speed of separation that restitution requires; 0: none. Negative until the contact has
  /// pushed in this step.
  Real rebound = 0;
  std::uint32_t a = 0, b = 0;  ///< bodies; a is movable
};

/// `kFixed`: body b does not move.
template <bool kFixed>
JFPX_HD constexpr void set_masses(SphereRow* row, const SolverBody& a, const SolverBody& b) {
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

template <bool kFixed>
JFPX_HD constexpr void warm_start(const SphereRow& row, SolverBody* a, SolverBody* b) {
  apply<kFixed>(row, row.normal * row.normal_impulse + row.friction_impulse, row.friction_impulse,
                a, b);
}

/// One iteration: friction within Coulomb's cone, and the impulse along the normal.
/// @param soft whether penetrations are pushed out
template <bool kFixed>
JFPX_HD inline void solve(SphereRow* row, SolverBody* a, SolverBody* b, const StepConstants& step,
                          bool soft) {
  const Vec3& n = row->normal;
  Vec3 shift = a->shift;
  if constexpr (!kFixed) shift -= b->shift;
  const Real separation = row->distance + dot(shift, n);
  if (is_idle(separation, row->normal_impulse, soft)) return;
  const Bias bias = bias_of(separation, kFixed ? step.fixed : step.movable, step, soft);
  const Vec3 velocity = relative_velocity<kFixed>(*row, *a, *b);
  const Real closing = dot(velocity, n);

  Vec3 friction = row->friction_impulse - (velocity - n * closing) * row->tangent_mass;
  const Real limit = row->friction * row->normal_impulse;
  const Real size2 = length_squared(friction);
  if (size2 > limit * limit) friction *= limit / square_root(size2);
  const Vec3 tangential = friction - row->friction_impulse;
  row->friction_impulse = friction;

  const Real change = -(row->normal_mass * bias.mass_scale) * (closing + bias.velocity) -
                      bias.impulse_scale * row->normal_impulse;
  const Real wanted = row->normal_impulse + change;
  const Real normal_impulse = wanted > 0 ? wanted : Real(0);
  const Real along = normal_impulse - row->normal_impulse;
  row->normal_impulse = normal_impulse;
  if (normal_impulse > 0 && row->rebound < 0) row->rebound = -row->rebound;
  apply<kFixed>(*row, n * along + tangential, tangential, a, b);
  if (bias.projection > 0) {
    const Vec3 impulse = n * (bias.projection * row->normal_mass);
    a->shift += impulse * a->inverse_mass;
    if constexpr (!kFixed) b->shift -= impulse * b->inverse_mass;
  }
}

/// Gives the bodies of an impact their speed of separation, after the last substep. The impulse is
/// not kept for the next step.
template <bool kFixed>
JFPX_HD inline void restitute(const SphereRow& row, SolverBody* a, SolverBody* b) {
  if (!(row.rebound > 0)) return;
  const Real closing = dot(relative_velocity<kFixed>(row, *a, *b), row.normal);
  const Real change = row.normal_mass * (row.rebound - closing);
  const Real along = change > -row.normal_impulse ? change : -row.normal_impulse;
  apply<kFixed>(row, row.normal * along, {}, a, b);
}

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
