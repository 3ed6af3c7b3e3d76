/// Contact of two bodies of any shape in a soft step: up to eight points with one normal, which are
/// solved one after the other, and friction of the whole contact: sliding friction at one point,
/// friction about the normal, and rolling and spinning friction.
#pragma once

#include "src/collide/pair_manifold.hpp"
#include "src/contact_solver/soft_step/body_pair.hpp"

#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// Angular part of a row along a direction u with lever arms r: the change of the relative velocity
/// along u is dot(turn_a, angular velocity of a) - dot(turn_b, that of b), and an impulse p along u
/// changes the angular velocities by spin_a * p and -spin_b * p.
struct Lever {
  Vec3 turn_a;  ///< [m], cross(r_a, u)
  Vec3 turn_b;  ///< [m], cross(r_b, u)
  Vec3 spin_a;  ///< [1/(kg m)], turn_a times the inverse inertia
  Vec3 spin_b;  ///< [1/(kg m)]
};

/// A point of a contact. Aligned, so that vectors load four numbers of it.
struct alignas(4 * sizeof(Real)) PointRow {
  Vec3 turn_a;        ///< see Lever
  Real distance = 0;  ///< [m], at the start of the step
  Vec3 turn_b;
  Real normal_mass = 0;  ///< [kg]
  Vec3 spin_a;
  Real normal_impulse = 0;  ///< [N s]
  Vec3 spin_b;
  /// [m/s], rebound speed after the impact; 0: no rebound. The sign bit is set, also of 0, until
  /// the point has pushed the bodies apart in this step.
  Real rebound = 0;
};

/// Whether the point has pushed the bodies apart in this step.
JFPX_HD inline bool has_pushed(const PointRow& p) { return !std::signbit(p.rebound); }

/// A sweep changes only the impulses of friction and the points: see store_changes().
struct alignas(4 * sizeof(Real)) ManifoldRow {
  using Part = PointRow;
  static constexpr bool kReadsRotation = true, kReadsOrientation = false;

  std::uint32_t a = 0, b = 0;  ///< bodies; a is movable
  std::uint32_t first = 0;     ///< index of the first point
  std::uint32_t count = 0;     ///< number of points
  Vec3 normal;
  Real friction = 0;
  Vec3 tangent;
  Real twist_arm = 0;  ///< [m], mean distance of the points from the centre of friction
  Vec3 bitangent;
  Real twist_mass = 0;                  ///< [kg m^2], effective mass of rotations about the normal
  Lever x, y;                           ///< of the tangents, at the centre of friction
  Vec3 twist_a, twist_b;                ///< [1/(kg m^2)], inverse inertia times the normal
  Real xx = 0, xy = 0;                  ///< [kg], effective mass of the two tangents, at rest
  Real friction_x = 0, friction_y = 0;  ///< [N s], along the tangents
  Real twist_impulse = 0;               ///< [N m s], about the normal
  Real yy = 0;                          ///< [kg]
  Real slip_mass = 0;                   ///< [kg], the smallest effective mass of a tangent
  Real rolling_friction = 0, spinning_friction = 0;  ///< [m]
  Vec3 rolling_impulse;  ///< [N m s], torque impulse of rolling and spinning friction on a
  /// Whether a movable body has joints. Such a contact is softer (see make_step_constants()), and
  /// does not project the bodies: it would pull joints open, and tangled limbs would stay tangled.
  std::uint32_t is_jointed = 0;
};

/// Writes the fields that a sweep changes.
JFPX_HD inline void store_changes(const ManifoldRow& from, ManifoldRow* to) {
  to->friction_x = from.friction_x;
  to->friction_y = from.friction_y;
  to->twist_impulse = from.twist_impulse;
  to->rolling_impulse = from.rolling_impulse;
}

template <bool kFixed>
JFPX_HD constexpr void apply(const BodyPair& pair, const Vec3& impulse, const Vec3& spin_a,
                             const Vec3& spin_b) {
  pair.a->velocity += impulse * pair.a->inverse_mass;
  pair.a->angular_velocity += spin_a;
  if constexpr (!kFixed) {
    pair.b->velocity -= impulse * pair.b->inverse_mass;
    pair.b->angular_velocity -= spin_b;
  }
}

/// Moves the bodies; compare apply().
template <bool kFixed>
JFPX_HD constexpr void project(const BodyPair& pair, const PointRow& p, const Vec3& normal,
                               Real impulse) {
  pair.a->shift += normal * impulse * pair.a->inverse_mass;
  pair.a->rotation += p.spin_a * impulse;
  if constexpr (!kFixed) {
    pair.b->shift -= normal * impulse * pair.b->inverse_mass;
    pair.b->rotation -= p.spin_b * impulse;
  }
}

template <bool kFixed>
JFPX_HD constexpr void apply_torque(const BodyPair& pair, const Vec3& torque_impulse) {
  pair.a->angular_velocity += *pair.inertia_a * torque_impulse;
  if constexpr (!kFixed) pair.b->angular_velocity -= *pair.inertia_b * torque_impulse;
}

/// Sets the angular part of a row. The body b of a fixed row may move, but has no inertia.
template <bool kFixed, class Row>
JFPX_HD constexpr void set_lever(const BodyPair& pair, const Vec3& arm_a, const Vec3& arm_b,
                                 const Vec3& u, Row* row) {
  row->turn_a = cross(arm_a, u);
  row->turn_b = cross(arm_b, u);
  row->spin_a = *pair.inertia_a * row->turn_a;
  row->spin_b = kFixed ? Vec3{} : *pair.inertia_b * row->turn_b;
}

/// Change of the relative velocity along u by an impulse along v, without the linear part.
template <class Row>
JFPX_HD constexpr Real turning(const Row& u, const Row& v) {
  return dot(u.turn_a, v.spin_a) + dot(u.turn_b, v.spin_b);
}

/// Relative velocity of the bodies along u at a row's lever arms.
template <class Row>
JFPX_HD constexpr Real speed_along(const BodyPair& pair, const Vec3& u, const Row& row) {
  return dot(pair.a->velocity - pair.b->velocity, u) +
         (dot(row.turn_a, pair.a->angular_velocity) - dot(row.turn_b, pair.b->angular_velocity));
}

template <bool kFixed>
JFPX_HD constexpr Real linear_response(const BodyPair& pair) {
  return kFixed ? pair.a->inverse_mass : pair.a->inverse_mass + pair.b->inverse_mass;
}

/// Determinant of a regular matrix of two tangents, divided by the product of its diagonal.
inline constexpr Real kLeastDeterminant = 8 * kEpsilon;

/// Effective masses of friction. The levers must be set.
template <bool kFixed>
JFPX_HD inline void set_friction_masses(ManifoldRow* row, const BodyPair& pair) {
  const Real linear = linear_response<kFixed>(pair);
  const Real xx = linear + turning(row->x, row->x), yy = linear + turning(row->y, row->y);
  const Real xy = turning(row->x, row->y);
  const Real half_sum = (xx + yy) * Real(0.5), half_difference = (xx - yy) * Real(0.5);
  const Real highest = half_sum + square_root(half_difference * half_difference + xy * xy);
  row->slip_mass = 1 / highest;
  const Real determinant = xx * yy - xy * xy;
  // The matrix is positive definite; rounding may make it singular for extreme ratios of mass.
  if (determinant > kLeastDeterminant * xx * yy) {
    const Real k = 1 / determinant;
    row->xx = yy * k, row->yy = xx * k, row->xy = -xy * k;
  } else {
    row->xx = row->yy = row->slip_mass, row->xy = 0;
  }
  row->twist_a = *pair.inertia_a * row->normal;
  row->twist_b = kFixed ? Vec3{} : *pair.inertia_b * row->normal;
  const Real twist = dot(row->twist_a, row->normal) + dot(row->twist_b, row->normal);
  row->twist_mass = twist > 0 ? 1 / twist : Real(0);
}

/// Applies impulses of friction.
template <bool kFixed>
JFPX_HD constexpr void apply_friction(const ManifoldRow& row, const BodyPair& pair, Real x, Real y,
                                      Real twist) {
  apply<kFixed>(pair, row.tangent * x + row.bitangent * y,
                (row.x.spin_a * x + row.y.spin_a * y) + row.twist_a * twist,
                (row.x.spin_b * x + row.y.spin_b * y) + row.twist_b * twist);
}

template <bool kFixed>
JFPX_HD constexpr void warm_start(const ManifoldRow& row, const PointRow* points,
                                  const BodyPair& pair) {
  for (std::uint32_t i = 0; i < row.count; ++i) {
    const PointRow& p = points[i];
    apply<kFixed>(pair, row.normal * p.normal_impulse, p.spin_a * p.normal_impulse,
                  p.spin_b * p.normal_impulse);
  }
  apply_friction<kFixed>(row, pair, row.friction_x, row.friction_y, row.twist_impulse);
  if (!(row.rolling_impulse == Vec3{})) apply_torque<kFixed>(pair, row.rolling_impulse);
}

/// Rolling friction opposes the relative angular velocity in the tangent plane, spinning friction
/// that about the normal. The torques are limited by a length times the normal impulse.
template <bool kFixed>
JFPX_HD inline void solve_rolling(ManifoldRow* row, Real pressure, const BodyPair& pair) {
  Mat3 response = *pair.inertia_a;
  if constexpr (!kFixed) response = response + *pair.inertia_b;
  response = regular_response(response);
  Mat3 mass;
  const Real scale = response(0, 0) + response(1, 1) + response(2, 2);
  if (!(scale > 0) || !invert(response * (1 / scale), &mass)) return;
  const Vec3 velocity = pair.a->angular_velocity - pair.b->angular_velocity;
  const Vec3 wanted = row->rolling_impulse - mass * velocity * (1 / scale);
  Real spin = dot(wanted, row->normal);
  Vec3 roll = wanted - row->normal * spin;
  const Real spin_limit = row->spinning_friction * pressure;
  spin = spin > spin_limit ? spin_limit : spin < -spin_limit ? -spin_limit : spin;
  const Real roll_limit = row->rolling_friction * pressure, size2 = length_squared(roll);
  if (size2 > roll_limit * roll_limit) roll *= roll_limit / square_root(size2);
  const Vec3 impulse = roll + row->normal * spin;
  const Vec3 change = impulse - row->rolling_impulse;
  row->rolling_impulse = impulse;
  apply_torque<kFixed>(pair, change);
}

/// Friction of the whole contact at its centre of friction, within Coulomb's cone, and about the
/// normal.
template <bool kFixed>
JFPX_HD inline void solve_friction(ManifoldRow* row, Real pressure, const BodyPair& pair) {
  const Real limit = row->friction * pressure;
  const Real vx = speed_along(pair, row->tangent, row->x);
  const Real vy = speed_along(pair, row->bitangent, row->y);
  Real x = row->friction_x - (row->xx * vx + row->xy * vy);
  Real y = row->friction_y - (row->xy * vx + row->yy * vy);
  Real size2 = x * x + y * y;
  if (size2 > limit * limit) {
    // A sliding contact uses the same mass for all tangents. With unequal masses, its friction
    // would not become opposite to the velocity.
    x = row->friction_x - row->slip_mass * vx, y = row->friction_y - row->slip_mass * vy;
    size2 = x * x + y * y;
    if (size2 > limit * limit) {
      const Real k = limit / square_root(size2);
      x *= k, y *= k;
    }
  }
  const Real spin = dot(pair.a->angular_velocity - pair.b->angular_velocity, row->normal);
  const Real twist_limit = limit * row->twist_arm;
  Real twist = row->twist_impulse - row->twist_mass * spin;
  twist = twist > twist_limit ? twist_limit : twist < -twist_limit ? -twist_limit : twist;
  apply_friction<kFixed>(*row, pair, x - row->friction_x, y - row->friction_y,
                         twist - row->twist_impulse);
  row->friction_x = x, row->friction_y = y, row->twist_impulse = twist;
}

template <bool kFixed>
JFPX_HD constexpr const Softness& softness_of(const ManifoldRow& row, const StepConstants& step) {
  if (row.is_jointed != 0) return kFixed ? step.jointed_fixed : step.jointed;
  return kFixed ? step.fixed : step.movable;
}

/// Normal impulses of all points, one after the other.
template <bool kFixed>
JFPX_HD inline void solve_normals(const ManifoldRow& row, PointRow* points, const BodyPair& pair,
                                  const StepConstants& step, bool use_bias) {
  const Vec3 n = row.normal;
  const std::uint32_t count = row.count;
  const Softness softness = softness_of<kFixed>(row, step);
  PointRow next = points[0];
  for (std::uint32_t i = 0; i < count; ++i) {
    const PointRow p = next;
    if (i + 1 < count) next = points[i + 1];  // so that a device does not wait for the point
    const Real moved = dot(pair.a->shift - pair.b->shift, n) +
                       (dot(p.turn_a, pair.a->rotation) - dot(p.turn_b, pair.b->rotation));
    const Real separation = p.distance + moved;
    if (is_idle(separation, p.normal_impulse, use_bias)) continue;
    const Bias bias = bias_of(separation, softness, step, use_bias);
    const Real closing = speed_along(pair, n, p);
    const Real change = -(p.normal_mass * bias.mass_scale) * (closing + bias.velocity) -
                        bias.impulse_scale * p.normal_impulse;
    const Real wanted = p.normal_impulse + change;
    const Real normal_impulse = wanted > 0 ? wanted : Real(0);
    const Real along = normal_impulse - p.normal_impulse;
    points[i].normal_impulse = normal_impulse;
    if (normal_impulse > 0 && !has_pushed(p)) points[i].rebound = -p.rebound;
    apply<kFixed>(pair, n * along, p.spin_a * along, p.spin_b * along);
    if (bias.projection > 0 && row.is_jointed == 0)
      project<kFixed>(pair, p, n, bias.projection * p.normal_mass);
  }
}

JFPX_HD inline Real pressure_of(const ManifoldRow& row, const PointRow* points) {
  Real pressure = 0;
  for (std::uint32_t i = 0; i < row.count; ++i) pressure += points[i].normal_impulse;
  return pressure;
}

/// Friction of the whole contact.
template <bool kFixed>
JFPX_HD inline void solve_tangents(ManifoldRow* row, const PointRow* points, const BodyPair& pair) {
  const Real pressure = pressure_of(*row, points);
  if (row->rolling_friction > 0 || row->spinning_friction > 0) {
    solve_rolling<kFixed>(row, pressure, pair);
  }
  solve_friction<kFixed>(row, pressure, pair);
}

/// Number of iterations over the points of a row in a sweep. The points are coupled, so a second
/// iteration of a relax sweep nearly solves them together. A second iteration of a bias sweep would
/// let columns of boxes sway without end.
JFPX_HD inline int iterations_of(const ManifoldRow& row, bool use_bias) {
  return row.count > 1 && !use_bias ? 2 : 1;
}

/// The iterations of a sweep. The bias sweep does not solve friction, which would couple the
/// push-out to the tangents: pyramids of boxes would keep oscillating.
template <bool kFixed>
JFPX_HD inline void solve(ManifoldRow* row, PointRow* points, const BodyPair& pair,
                          const StepConstants& step, bool use_bias) {
  for (int i = 0; i < iterations_of(*row, use_bias); ++i) {
    solve_normals<kFixed>(*row, points, pair, step, use_bias);
    if (!use_bias) solve_tangents<kFixed>(row, points, pair);
  }
}

/// Whether restitute() has an effect if the points push the bodies apart.
JFPX_HD inline bool any_rebounds(const ManifoldRow& row, const PointRow* points) {
  bool any = false;
  for (std::uint32_t i = 0; i < row.count; ++i) any |= points[i].rebound < 0;
  return any;
}

/// Rebound of the points that have pushed the bodies apart. The points of a row are solved
/// together: after a single iteration, the first points would have added energy.
template <bool kFixed>
JFPX_HD inline void restitute(const ManifoldRow& row, const PointRow* points,
                              const BodyPair& pair) {
  constexpr int kIterations = 16;
  const int iterations = row.count > 1 ? kIterations : 1;
  Real added[detail::PairManifold::kMaxPoints] = {};  // [N s]
  for (int k = 0; k < iterations; ++k) {
    for (std::uint32_t i = 0; i < row.count; ++i) {
      const PointRow& p = points[i];
      if (!(p.rebound > 0)) continue;
      const Real closing = speed_along(pair, row.normal, p);
      const Real wanted = added[i] + p.normal_mass * (p.rebound - closing);
      const Real sum = wanted > -p.normal_impulse ? wanted : -p.normal_impulse;
      const Real along = sum - added[i];
      added[i] = sum;
      apply<kFixed>(pair, row.normal * along, p.spin_a * along, p.spin_b * along);
    }
  }
}

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
