/// Contact of two bodies of any shape in a soft step: up to eight points with one normal, which are
/// solved one after the other, and rolling and spinning friction.
#pragma once

#include "src/contact_solver/soft_step/body_pair.hpp"

#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

struct PointRow {
  Vec3 arm_a, arm_b;            ///< [m], from the centres of mass to the point
  Real distance = 0;            ///< [m], at the start of the step
  Real normal_mass = 0;         ///< [kg]
  Real xx = 0, xy = 0, yy = 0;  ///< [kg], effective mass of the two tangents, at rest
  Real slip_mass = 0;           ///< [kg], the smallest effective mass of a tangent
  /// [m/s], rebound speed after the impact; 0: no rebound. The sign bit is set, also of 0, until
  /// the point has pushed the bodies apart in this step.
  Real rebound = 0;
  Real normal_impulse = 0;              ///< [N s]
  Real friction_x = 0, friction_y = 0;  ///< [N s], along the tangents
};

/// Whether the point has pushed the bodies apart in this step.
JFPX_HD inline bool has_pushed(const PointRow& p) { return !std::signbit(p.rebound); }

/// A sweep changes only `rolling_impulse` and the points: see store_changes().
struct ManifoldRow {
  using Part = PointRow;
  static constexpr bool kReadsRotation = true, kReadsOrientation = false;

  std::uint32_t a = 0, b = 0;  ///< bodies; a is movable
  std::uint32_t first = 0;     ///< index of the first point
  std::uint32_t count = 0;     ///< number of points
  Vec3 normal, tangent, bitangent;
  Real friction = 0;
  Real rolling_friction = 0, spinning_friction = 0;  ///< [m]
  Vec3 rolling_impulse;  ///< [N m s], torque impulse of rolling and spinning friction on a
};

/// Writes the fields that a sweep changes.
JFPX_HD inline void store_changes(const ManifoldRow& from, ManifoldRow* to) {
  to->rolling_impulse = from.rolling_impulse;
}

template <bool kFixed>
JFPX_HD constexpr void apply(const BodyPair& pair, const Vec3& arm_a, const Vec3& arm_b,
                             const Vec3& impulse) {
  pair.a->velocity += impulse * pair.a->inverse_mass;
  pair.a->angular_velocity += *pair.inertia_a * cross(arm_a, impulse);
  if constexpr (!kFixed) {
    pair.b->velocity -= impulse * pair.b->inverse_mass;
    pair.b->angular_velocity -= *pair.inertia_b * cross(arm_b, impulse);
  }
}

/// Moves the bodies; compare apply().
template <bool kFixed>
JFPX_HD constexpr void project(const BodyPair& pair, const PointRow& p, const Vec3& impulse) {
  pair.a->shift += impulse * pair.a->inverse_mass;
  pair.a->rotation += *pair.inertia_a * cross(p.arm_a, impulse);
  if constexpr (!kFixed) {
    pair.b->shift -= impulse * pair.b->inverse_mass;
    pair.b->rotation -= *pair.inertia_b * cross(p.arm_b, impulse);
  }
}

template <bool kFixed>
JFPX_HD constexpr void apply_torque(const BodyPair& pair, const Vec3& torque_impulse) {
  pair.a->angular_velocity += *pair.inertia_a * torque_impulse;
  if constexpr (!kFixed) pair.b->angular_velocity -= *pair.inertia_b * torque_impulse;
}

/// Change of the relative velocity along u per impulse along v.
template <bool kFixed>
JFPX_HD constexpr Real response(const BodyPair& pair, const PointRow& p, const Vec3& u,
                                const Vec3& v) {
  Real angular = dot(cross(p.arm_a, u), *pair.inertia_a * cross(p.arm_a, v));
  Real linear = pair.a->inverse_mass;
  if constexpr (!kFixed) {
    angular += dot(cross(p.arm_b, u), *pair.inertia_b * cross(p.arm_b, v));
    linear += pair.b->inverse_mass;
  }
  return linear * dot(u, v) + angular;
}

template <bool kFixed>
JFPX_HD inline void set_masses(const ManifoldRow& row, PointRow* p, const BodyPair& pair) {
  p->normal_mass = 1 / response<kFixed>(pair, *p, row.normal, row.normal);
  const Real xx = response<kFixed>(pair, *p, row.tangent, row.tangent);
  const Real yy = response<kFixed>(pair, *p, row.bitangent, row.bitangent);
  const Real xy = response<kFixed>(pair, *p, row.tangent, row.bitangent);
  const Real half_sum = (xx + yy) * Real(0.5), half_difference = (xx - yy) * Real(0.5);
  const Real highest = half_sum + square_root(half_difference * half_difference + xy * xy);
  p->slip_mass = 1 / highest;
  const Real determinant = xx * yy - xy * xy;
  // The matrix is positive definite; rounding may make it singular for extreme ratios of mass.
  if (determinant > 8 * kEpsilon * xx * yy) {
    const Real k = 1 / determinant;
    p->xx = yy * k, p->yy = xx * k, p->xy = -xy * k;
  } else {
    p->xx = p->yy = p->slip_mass, p->xy = 0;
  }
}

template <bool kFixed>
JFPX_HD constexpr void warm_start(const ManifoldRow& row, const PointRow* points,
                                  const BodyPair& pair) {
  for (std::uint32_t i = 0; i < row.count; ++i) {
    const PointRow& p = points[i];
    const Vec3 impulse =
        row.normal * p.normal_impulse + (row.tangent * p.friction_x + row.bitangent * p.friction_y);
    apply<kFixed>(pair, p.arm_a, p.arm_b, impulse);
  }
  if (!(row.rolling_impulse == Vec3{})) apply_torque<kFixed>(pair, row.rolling_impulse);
}

/// Rolling friction opposes the relative angular velocity in the tangent plane, spinning friction
/// that about the normal. The torques are limited by a length times the normal impulse.
template <bool kFixed>
JFPX_HD inline void solve_rolling(ManifoldRow* row, const PointRow* points, const BodyPair& pair) {
  Mat3 response = *pair.inertia_a;
  if constexpr (!kFixed) response = response + *pair.inertia_b;
  Mat3 mass;
  const Real scale = response(0, 0) + response(1, 1) + response(2, 2);
  if (!(scale > 0) || !invert(response * (1 / scale), &mass)) return;
  Real pressure = 0;
  for (std::uint32_t i = 0; i < row->count; ++i) pressure += points[i].normal_impulse;
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

/// Friction of all points, within Coulomb's cone.
template <bool kFixed>
JFPX_HD inline void solve_friction(const ManifoldRow& row, PointRow* points, const BodyPair& pair) {
  for (std::uint32_t i = 0; i < row.count; ++i) {
    PointRow& p = points[i];
    const Vec3 velocity = relative_velocity(pair, p.arm_a, p.arm_b);
    const Real vx = dot(velocity, row.tangent), vy = dot(velocity, row.bitangent);
    Real x = p.friction_x - (p.xx * vx + p.xy * vy);
    Real y = p.friction_y - (p.xy * vx + p.yy * vy);
    const Real limit = row.friction * p.normal_impulse;
    Real size2 = x * x + y * y;
    if (size2 > limit * limit) {
      // A sliding point uses the same mass for all tangents. With unequal masses, its friction
      // would not become opposite to the velocity, and the points would block each other.
      x = p.friction_x - p.slip_mass * vx, y = p.friction_y - p.slip_mass * vy;
      size2 = x * x + y * y;
      if (size2 > limit * limit) {
        const Real k = limit / square_root(size2);
        x *= k, y *= k;
      }
    }
    const Vec3 impulse = row.tangent * (x - p.friction_x) + row.bitangent * (y - p.friction_y);
    p.friction_x = x, p.friction_y = y;
    apply<kFixed>(pair, p.arm_a, p.arm_b, impulse);
  }
}

/// Normal impulses of all points, one after the other.
template <bool kFixed>
JFPX_HD inline void solve_normals(const ManifoldRow& row, PointRow* points, const BodyPair& pair,
                                  const StepConstants& step, bool use_bias) {
  const Vec3& n = row.normal;
  for (std::uint32_t i = 0; i < row.count; ++i) {
    PointRow& p = points[i];
    const Vec3 moved = (pair.a->shift + cross(pair.a->rotation, p.arm_a)) -
                       (pair.b->shift + cross(pair.b->rotation, p.arm_b));
    const Real separation = p.distance + dot(moved, n);
    if (is_idle(separation, p.normal_impulse, use_bias)) continue;
    const Bias bias = bias_of(separation, kFixed ? step.fixed : step.movable, step, use_bias);
    const Real closing = dot(relative_velocity(pair, p.arm_a, p.arm_b), n);
    const Real change = -(p.normal_mass * bias.mass_scale) * (closing + bias.velocity) -
                        bias.impulse_scale * p.normal_impulse;
    const Real wanted = p.normal_impulse + change;
    const Real normal_impulse = wanted > 0 ? wanted : Real(0);
    const Vec3 impulse = n * (normal_impulse - p.normal_impulse);
    p.normal_impulse = normal_impulse;
    if (normal_impulse > 0 && !has_pushed(p)) p.rebound = -p.rebound;
    apply<kFixed>(pair, p.arm_a, p.arm_b, impulse);
    if (bias.projection > 0) project<kFixed>(pair, p, n * (bias.projection * p.normal_mass));
  }
}

/// One iteration over all points: friction first, because the normal impulse matters more. The bias
/// sweep does not solve friction, which would couple the push-out to the tangents: pyramids of
/// boxes would keep oscillating. The points of a manifold are coupled, so a second pass over them
/// nearly solves them together.
/// them nearly solves them together.
template <bool kFixed>
JFPX_HD inline void solve(ManifoldRow* row, PointRow* points, const BodyPair& pair,
                          const StepConstants& step, bool use_bias) {
  if (!use_bias) {
    if (row->rolling_friction > 0 || row->spinning_friction > 0) {
      solve_rolling<kFixed>(row, points, pair);
    }
    solve_friction<kFixed>(*row, points, pair);
  }
  solve_normals<kFixed>(*row, points, pair, step, use_bias);
  if (row->count > 1) solve_normals<kFixed>(*row, points, pair, step, use_bias);
}

/// Whether restitute() has an effect if the points push the bodies apart.
JFPX_HD inline bool any_rebounds(const ManifoldRow& row, const PointRow* points) {
  bool any = false;
  for (std::uint32_t i = 0; i < row.count; ++i) any |= points[i].rebound < 0;
  return any;
}

template <bool kFixed>
JFPX_HD inline void restitute(const ManifoldRow& row, const PointRow* points,
                              const BodyPair& pair) {
  for (std::uint32_t i = 0; i < row.count; ++i) {
    const PointRow& p = points[i];
    if (!(p.rebound > 0)) continue;
    const Real closing = dot(relative_velocity(pair, p.arm_a, p.arm_b), row.normal);
    const Real change = p.normal_mass * (p.rebound - closing);
    const Real along = change > -p.normal_impulse ? change : -p.normal_impulse;
    apply<kFixed>(pair, p.arm_a, p.arm_b, row.normal * along);
  }
}

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
