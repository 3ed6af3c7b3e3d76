/// Arithmetic of Bullet's sequential impulse solver for a contact and its friction, for any number
/// of contacts in parallel lanes.
#pragma once

// Sources that are compiled for other instruction sets include this header (see
// src/sphere_collider/cpu/kernels.hpp). It therefore contains only templates over a type with
// internal linkage, and includes no other headers.
#include <jfpx/config.hpp>

#include "src/contact_solver/sequential_impulse/row_layout.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace rows {

// Every expression preserves the order of operations of the scalar row solver of Bullet 3.24
// (btSequentialImpulseConstraintSolver.cpp), with one rounding per operation, because results are
// compared bit by bit. This includes operations that look redundant: 0 + x changes -0 to 0, and
// x - 0 * y is not always x.
//
// `S` defines the arithmetic: S::Vec has S::kLanes numbers and S::Mask has one truth value per
// lane. S also accesses the bodies that S::Id identifies.

// Forces inlining of row functions: vectors passed through memory cost more than the arithmetic.
#if defined(__CUDACC__)
#define JFPX_ROW __host__ __device__ __forceinline__
#else
#define JFPX_ROW [[gnu::always_inline]] inline
#endif

template <class S>
struct Vec3Of {
  using V = typename S::Vec;
  V x, y, z;

  JFPX_ROW friend Vec3Of operator+(const Vec3Of& a, const Vec3Of& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
  JFPX_ROW friend Vec3Of operator-(const Vec3Of& a, const Vec3Of& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  JFPX_ROW friend Vec3Of operator*(const Vec3Of& a, V s) { return {a.x * s, a.y * s, a.z * s}; }
  JFPX_ROW friend Vec3Of operator*(const Vec3Of& a, const Vec3Of& b) {
    return {a.x * b.x, a.y * b.y, a.z * b.z};
  }
  JFPX_ROW friend Vec3Of operator-(const Vec3Of& a) {
    return {S::negate(a.x), S::negate(a.y), S::negate(a.z)};
  }
};

template <class S>
JFPX_ROW typename S::Vec dot(const Vec3Of<S>& a, const Vec3Of<S>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class S>
JFPX_ROW Vec3Of<S> cross(const Vec3Of<S>& a, const Vec3Of<S>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
/// `v` where the mask is true, else +0.
template <class S>
JFPX_ROW Vec3Of<S> keep(typename S::Mask mask, const Vec3Of<S>& v) {
  return {S::keep(mask, v.x), S::keep(mask, v.y), S::keep(mask, v.z)};
}
template <class S>
JFPX_ROW Vec3Of<S> select(typename S::Mask mask, const Vec3Of<S>& a, const Vec3Of<S>& b) {
  return {S::select(mask, a.x, b.x), S::select(mask, a.y, b.y), S::select(mask, a.z, b.z)};
}
template <class S>
JFPX_ROW Vec3Of<S> load3(const Real* fields) {
  constexpr int kLanes = S::kLanes;
  return {S::load(fields), S::load(fields + kLanes), S::load(fields + 2 * kLanes)};
}
template <class S>
JFPX_ROW void store3(Real* fields, const Vec3Of<S>& v) {
  constexpr int kLanes = S::kLanes;
  S::store(fields, v.x);
  S::store(fields + kLanes, v.y);
  S::store(fields + 2 * kLanes, v.z);
}

/// State of one body of a contact, as input of the row setup.
template <class S>
struct BodyOf {
  using V3 = Vec3Of<S>;
  typename S::Mask real;  ///< false for Bullet's single fixed body, whose other fields are all 0
  V3 origin, linear, angular, forced_linear, forced_angular, angular_factor;
  V3 inertia[3];  ///< rows of the inverse inertia tensor
  typename S::Vec inverse_mass;

  JFPX_ROW V3 inertia_times(const V3& torque) const {
    return {dot(inertia[0], torque), dot(inertia[1], torque), dot(inertia[2], torque)};
  }
  JFPX_ROW V3 torque_response(const V3& torque) const {
    return keep<S>(real, inertia_times(torque));
  }
  JFPX_ROW V3 angular_response(const V3& torque) const {
    return keep<S>(real, inertia_times(torque) * angular_factor);
  }
  JFPX_ROW V3 velocity_at(const V3& arm) const {
    return keep<S>(real, linear + cross(angular, arm));
  }
  JFPX_ROW V3 forced_velocity_at(const V3& arm) const {
    return keep<S>(real, forced_linear + cross(forced_angular, arm));
  }
};

template <class S>
JFPX_ROW BodyOf<S> gather_body(const Real* bodies, const typename S::Id* ids) {
  typename S::Vec f[kBodyFields];
  for (int k = 0; k < kBodyFields; k += 4) S::gather4(bodies + k, ids, kBodyFields, f + k);
  BodyOf<S> b;
  b.real = S::is_real(ids);
  b.origin = {f[0], f[1], f[2]};
  b.inverse_mass = f[3];
  b.linear = {f[4], f[5], f[6]};
  b.angular = {f[8], f[9], f[10]};
  b.forced_linear = {f[12], f[13], f[14]};
  b.forced_angular = {f[16], f[17], f[18]};
  b.angular_factor = {f[7], f[11], f[15]};
  b.inertia[0] = {f[20], f[21], f[22]};
  b.inertia[1] = {f[24], f[25], f[26]};
  b.inertia[2] = {f[28], f[29], f[30]};
  return b;
}

template <class S>
JFPX_ROW Vec3Of<S> normalized(const Vec3Of<S>& v) {
  return v * (S::set(1) / S::square_root(dot(v, v)));
}

/// btPlaneSpace1(): two directions orthogonal to n and to each other.
template <class S>
JFPX_ROW void plane_space(const Vec3Of<S>& n, Vec3Of<S>* p, Vec3Of<S>* q) {
  const auto zero = S::set(0);
  const auto steep = S::less(S::set(Real(0.7071067811865475244008443621048490)), S::absolute(n.z));
  const auto a = S::select(steep, n.y * n.y + n.z * n.z, n.x * n.x + n.y * n.y);
  const auto k = S::set(1) / S::square_root(a);
  const Vec3Of<S> p_steep = {zero, S::negate(n.z) * k, n.y * k};
  const Vec3Of<S> p_flat = {S::negate(n.y) * k, n.x * k, zero};
  const Vec3Of<S> q_steep = {a * k, S::negate(n.x) * p_steep.z, n.x * p_steep.y};
  const Vec3Of<S> q_flat = {S::negate(n.z) * p_flat.y, n.z * p_flat.x, a * k};
  *p = select<S>(steep, p_steep, p_flat);
  *q = select<S>(steep, q_steep, q_flat);
}

/// First half of the setup of a contact: writes the row of the contact, and the friction direction
/// as the axis of the friction row. Writes the second friction direction to `second`.
/// @return the lanes in which Bullet stores the second direction, because the contact does not
///   slide
template <class S>
JFPX_ROW typename S::Mask set_up_contact(const RowSettings& settings, const Real* in,
                                         const Real* bodies, const typename S::Id* ids, Real* row,
                                         Real* friction, Real* second) {
  constexpr int kLanes = S::kLanes;
  using V3 = Vec3Of<S>;
  const auto field = [&](int i) { return S::load(in + i * kLanes); };
  const auto zero = S::set(0);
  const BodyOf<S> a = gather_body<S>(bodies, ids), b = gather_body<S>(bodies, ids + kLanes);
  const V3 n = load3<S>(in + kInNormal * kLanes);
  const V3 arm_a = load3<S>(in + kInPointA * kLanes) - a.origin;
  const V3 arm_b = load3<S>(in + kInPointB * kLanes) - b.origin;
  const auto inverse_dt = S::set(settings.inverse_dt);
  const auto cfm = field(kInCfm) * inverse_dt;

  const V3 torque_a = cross(arm_a, n), torque_b = cross(arm_b, n);
  const V3 angular_a = a.angular_response(torque_a), angular_b = b.angular_response(-torque_b);
  const auto denominator_a = S::keep(a.real, a.inverse_mass + dot(n, cross(angular_a, arm_a)));
  const auto denominator_b = S::keep(b.real, b.inverse_mass + dot(n, cross(-angular_b, arm_b)));
  // Lanes without a contact have no body: replaces 1/0 by 1.
  const auto used = S::either(a.real, b.real);
  const auto inverse = S::select(
      used, S::set(settings.relaxation) / (denominator_a + denominator_b + cfm), S::set(1));
  const V3 normal_a = keep<S>(a.real, n), jacobian_a = keep<S>(a.real, torque_a);
  const V3 normal_b = keep<S>(b.real, -n), jacobian_b = keep<S>(b.real, -torque_b);

  const auto approach = dot(n, a.velocity_at(arm_a) - b.velocity_at(arm_b));
  auto bounce = S::select(S::less(S::absolute(approach), S::set(settings.restitution_threshold)),
                          zero, field(kInRestitution) * S::negate(approach));
  bounce = S::select(S::less_equal(bounce, zero), zero, bounce);
  const auto penetration = field(kInDistance) + S::set(settings.slop);
  const auto velocity_a = dot(normal_a, a.forced_linear) + dot(jacobian_a, a.forced_angular);
  const auto velocity_b = dot(normal_b, b.forced_linear) + dot(jacobian_b, b.forced_angular);
  auto velocity_error = bounce - (velocity_a + velocity_b);
  const auto apart = S::less(zero, penetration);
  velocity_error = S::select(apart, velocity_error - penetration * inverse_dt, velocity_error);
  const auto position_error =
      S::select(apart, zero, S::negate(penetration) * field(kInErp) * inverse_dt);
  const auto position_impulse = position_error * inverse;
  const auto velocity_impulse = velocity_error * inverse;
  const auto joined =
      settings.split ? S::less(S::set(settings.split_threshold), penetration) : S::always();

  const auto put = [&](int i, typename S::Vec v) { S::store(row + i * kLanes, v); };
  store3<S>(row + kRowAxis * kLanes, n);
  store3<S>(row + kRowAngularJacobianA * kLanes, jacobian_a);
  store3<S>(row + kRowAngularJacobianB * kLanes, jacobian_b);
  store3<S>(row + kRowAngularA * kLanes, angular_a);
  store3<S>(row + kRowAngularB * kLanes, angular_b);
  put(kRowInverse, inverse);
  put(kRowRhs,
      S::keep(used, S::select(joined, position_impulse + velocity_impulse, velocity_impulse)));
  put(kRowCfm, cfm * inverse);
  put(kRowImpulse, settings.warm_start ? field(kInImpulse) * S::set(settings.warm_factor) : zero);
  put(kRowSplitRhs, S::keep(used, S::select(joined, zero, position_impulse)));
  put(kRowSplitImpulse, zero);

  const V3 velocity = a.forced_velocity_at(arm_a) - b.forced_velocity_at(arm_b);
  const V3 sideways = velocity - n * dot(n, velocity);
  const auto speed2 = dot(sideways, sideways);
  auto slides = S::less(S::set(settings.epsilon), speed2);
  if (!settings.friction_follows_velocity) slides = S::never();
  V3 p, q;
  plane_space<S>(n, &p, &q);
  store3<S>(friction + kRowAxis * kLanes,
            select<S>(slides, sideways * (S::set(1) / S::square_root(speed2)), p));
  store3<S>(second, q);
  return S::negate_mask(slides);
}

/// The second friction direction, if Bullet has not stored one yet.
template <class S>
JFPX_ROW Vec3Of<S> across(const Vec3Of<S>& direction, const Vec3Of<S>& normal) {
  return normalized<S>(cross(direction, normal));
}

/// Second half of the setup: writes the friction row along the axis that the row contains.
template <class S>
JFPX_ROW void set_up_friction(const RowSettings& settings, const Real* in, const Real* bodies,
                              const typename S::Id* ids, Real* row) {
  constexpr int kLanes = S::kLanes;
  using V3 = Vec3Of<S>;
  const auto field = [&](int i) { return S::load(in + i * kLanes); };
  const auto zero = S::set(0);
  const BodyOf<S> a = gather_body<S>(bodies, ids), b = gather_body<S>(bodies, ids + kLanes);
  const V3 point_a = load3<S>(in + kInPointA * kLanes), point_b = load3<S>(in + kInPointB * kLanes);
  const V3 arm_a = point_a - a.origin, arm_b = point_b - b.origin;
  const V3 axis = load3<S>(row + kRowAxis * kLanes);
  const V3 axis_a = keep<S>(a.real, axis), axis_b = keep<S>(b.real, -axis);
  const V3 jacobian_a = keep<S>(a.real, cross(arm_a, axis)),
           jacobian_b = keep<S>(b.real, cross(arm_b, -axis));
  const V3 angular_a = a.angular_response(jacobian_a), angular_b = b.angular_response(jacobian_b);
  const auto denominator_a = S::keep(a.real, a.inverse_mass + dot(axis, cross(angular_a, arm_a)));
  const auto denominator_b = S::keep(b.real, b.inverse_mass + dot(axis, cross(-angular_b, arm_b)));
  const auto inverse = S::set(settings.relaxation) / (denominator_a + denominator_b);
  const auto velocity_a = dot(axis_a, a.forced_linear) + dot(jacobian_a, a.angular);
  const auto velocity_b = dot(axis_b, b.forced_linear) + dot(jacobian_b, b.angular);
  const auto velocity_impulse = (zero - (velocity_a + velocity_b)) * inverse;
  const auto offset = dot(point_a - point_b, axis);
  const auto anchor_error = S::negate(offset) * S::set(settings.friction_erp) / S::set(settings.dt);
  const auto anchored = S::less(zero, field(kInAnchor));
  const auto position_impulse = S::select(anchored, anchor_error * inverse, zero);

  store3<S>(row + kRowAngularJacobianA * kLanes, jacobian_a);
  store3<S>(row + kRowAngularJacobianB * kLanes, jacobian_b);
  store3<S>(row + kRowAngularA * kLanes, angular_a);
  store3<S>(row + kRowAngularB * kLanes, angular_b);
  S::store(row + kRowInverse * kLanes, inverse);
  S::store(row + kRowRhs * kLanes, position_impulse + velocity_impulse);
  S::store(row + kRowFriction * kLanes, field(kInFriction));
  S::store(row + kRowImpulse * kLanes, zero);
}

/// First half of the setup of the rolling and spinning friction rows of a contact: writes their
/// axes, which are the normal and two axes across it.
/// @param normal as 3 fields
template <class S>
JFPX_ROW void set_up_rolling_axes(const Real* normal, Real* rows) {
  constexpr int kLanes = S::kLanes;
  const Vec3Of<S> n = load3<S>(normal);
  Vec3Of<S> axes[kRollingRows] = {n, n, n};
  plane_space<S>(n, &axes[1], &axes[2]);
  for (std::uint32_t t = 0; t < kRollingRows; ++t) {
    if (t > 0) axes[t] = normalized<S>(axes[t]);
    store3<S>(rows + (t * kRollingFields + kRollingAxis) * kLanes, axes[t]);
  }
}

/// Second half of the setup: writes the other fields from the axes, the strengths, and
/// kRollingPresent of the first row, which holds for all of them.
template <class S>
JFPX_ROW void set_up_rolling_frictions(const Real* bodies, const typename S::Id* ids, Real* rows) {
  constexpr int kLanes = S::kLanes;
  using V3 = Vec3Of<S>;
  // The largest number up to 0.001: an axis that anisotropic friction makes shorter has no row.
  constexpr Real kLeastLength = sizeof(Real) == 4 ? Real(0x1.0624dcp-10) : Real(0.001);
  const auto zero = S::set(0);
  const V3 none = {zero, zero, zero};
  const BodyOf<S> a = gather_body<S>(bodies, ids), b = gather_body<S>(bodies, ids + kLanes);
  const auto rolls = S::load(rows + kRollingPresent * kLanes);
  for (std::uint32_t t = 0; t < kRollingRows; ++t) {
    Real* const row = rows + t * kRollingFields * kLanes;
    const V3 axis = load3<S>(row + kRollingAxis * kLanes), opposite = -axis;
    const auto is_long = S::less(S::set(kLeastLength), S::square_root(dot(axis, axis)));
    const auto inverse = S::set(1) / (zero + dot(a.torque_response(opposite), opposite) +
                                      dot(b.torque_response(axis), axis));
    const auto velocity_a = dot(none, a.forced_linear) + dot(opposite, a.angular);
    const auto velocity_b = dot(-none, b.forced_linear) + dot(axis, b.angular);
    const auto put = [&](int field, typename S::Vec v) { S::store(row + field * kLanes, v); };
    put(kRollingPresent, t == 0 ? rolls : S::keep(is_long, rolls));
    store3<S>(row + kRollingAngularA * kLanes, a.angular_response(opposite));
    store3<S>(row + kRollingAngularB * kLanes, b.angular_response(axis));
    put(kRollingInverse, inverse);
    put(kRollingRhs, (zero - (velocity_a + velocity_b)) * inverse);
    put(kRollingImpulse, zero);
  }
}

/// Which bodies of a row are moved by rows.
template <bool kMovedA, bool kMovedB>
struct MovedBodies {
  static constexpr bool kA = kMovedA, kB = kMovedB;
};
using BothMoved = MovedBodies<true, true>;

/// Delta velocities of the two bodies of a row, to which impulses are applied.
/// @tparam Moved the bodies that rows move in any lane. The delta velocities of the others are 0.
template <class S, bool kFactors, class Moved>
struct BodyVelocities {
  using V = typename S::Vec;
  using V3 = Vec3Of<S>;
  static constexpr int kLanes = S::kLanes;
  struct Body {
    V3 linear, angular;
    V mass, pad;
  };
  const typename S::Id* ids;
  Real* velocities;
  const Real* factors;
  Body a, b;

  JFPX_ROW BodyVelocities(const typename S::Id* i, Real* v, const Real* f)
      : ids(i),
        velocities(v),
        factors(f),
        a(load<Moved::kA>(i, v)),
        b(load<Moved::kB>(i + kLanes, v)) {}
  /// Subtracts the velocity along the row, times inverse, in Bullet's order of operations.
  JFPX_ROW V subtract_velocity(V impulse, V inverse, const V3& axis_a, const V3& axis_b,
                               const V3& jacobian_a, const V3& jacobian_b) const {
    const auto velocity_a = dot(axis_a, a.linear) + dot(jacobian_a, a.angular);
    const auto velocity_b = dot(axis_b, b.linear) + dot(jacobian_b, b.angular);
    impulse = impulse - velocity_a * inverse;
    return impulse - velocity_b * inverse;
  }
  /// Applies an impulse along a row in the active lanes.
  /// @param response_a address of the angular velocity that a unit impulse adds to body a
  JFPX_ROW void apply_impulse(V impulse, const V3& axis_a, const V3& axis_b, const Real* response_a,
                              const Real* response_b, typename S::Mask active) {
    if constexpr (Moved::kA) apply(ids, axis_a, load3<S>(response_a), impulse, active, &a);
    if constexpr (Moved::kB) apply(ids + kLanes, axis_b, load3<S>(response_b), impulse, active, &b);
  }
  /// Stores the velocities of the bodies that rows move.
  JFPX_ROW void store() const {
    if constexpr (Moved::kA) put(ids, a);
    if constexpr (Moved::kB) put(ids + kLanes, b);
  }

 private:
  template <bool kMoved>
  JFPX_ROW static Body load(const typename S::Id* body, const Real* from) {
    if constexpr (!kMoved) {
      const auto zero = S::set(0);
      return {{zero, zero, zero}, {zero, zero, zero}, zero, zero};
    }
    V u[4], w[4];
    S::gather4(from, body, kVelocityFields, u);
    S::gather4(from + 4, body, kVelocityFields, w);
    return {{u[0], u[1], u[2]}, {w[0], w[1], w[2]}, u[3], w[3]};
  }
  JFPX_ROW void apply(const typename S::Id* id, const V3& axis, const V3& response, V impulse,
                      typename S::Mask active, Body* body) const {
    V3 linear, angular;
    if constexpr (kFactors) {
      V m[4], l[4], t[4];
      S::gather4(factors, id, kFactorFields, m);
      S::gather4(factors + 4, id, kFactorFields, l);
      S::gather4(factors + 8, id, kFactorFields, t);
      const V3 masses = {m[0], m[1], m[2]}, linear_factor = {l[0], l[1], l[2]};
      const V3 angular_factor = {t[0], t[1], t[2]};
      linear = body->linear + axis * masses * impulse * linear_factor;
      angular = body->angular + response * (angular_factor * impulse);
    } else {
      linear = body->linear + axis * body->mass * impulse;
      angular = body->angular + response * impulse;
    }
    body->linear = select<S>(active, linear, body->linear);
    body->angular = select<S>(active, angular, body->angular);
  }
  JFPX_ROW void put(const typename S::Id* id, const Body& body) const {
    const V u[4] = {body.linear.x, body.linear.y, body.linear.z, body.mass};
    const V w[4] = {body.angular.x, body.angular.y, body.angular.z, body.pad};
    S::scatter8(velocities, id, kVelocityFields, u, w);
  }
};

/// The largest squared residual of a set of rows, and whether a residual is NaN.
template <class S>
struct Residual {
  typename S::Vec largest = S::set(0);
  typename S::Mask broken = S::never();

  JFPX_ROW void add(typename S::Vec impulse, typename S::Vec inverse, typename S::Mask active) {
    const auto residual = S::residual(impulse, inverse);
    const auto squared = S::keep(active, residual * residual);
    largest = S::select(S::less(largest, squared), squared, largest);
    broken = S::either(broken, S::unordered(squared));
  }
};

// `Sum` below is a Residual<S>, or a type that adds to a Residual<S> later.

/// Solves a contact row or its split impulse against penetration, which use different fields and
/// velocities.
template <class S, bool kFactors, bool kSplitImpulse, class Moved = BothMoved, class Sum>
JFPX_ROW void solve_contact(const typename S::Id* ids, Real* velocities, const Real* factors,
                            Real* row, Sum* residual) {
  constexpr int kLanes = S::kLanes;
  const auto zero = S::set(0);
  BodyVelocities<S, kFactors, Moved> pair(ids, velocities, factors);
  Real* const field = row + (kSplitImpulse ? kRowSplitImpulse : kRowImpulse) * kLanes;
  const auto before = S::load(field);
  const auto rhs = S::load(row + (kSplitImpulse ? kRowSplitRhs : kRowRhs) * kLanes);
  const auto inverse = S::load(row + kRowInverse * kLanes);
  const auto active = kSplitImpulse ? S::differs(rhs, zero) : S::always();
  const auto n = load3<S>(row + kRowAxis * kLanes);
  const auto axis_a = keep<S>(S::is_real(ids), n), axis_b = keep<S>(S::is_real(ids + kLanes), -n);
  auto impulse = rhs - before * S::load(row + kRowCfm * kLanes);
  impulse = pair.subtract_velocity(impulse, inverse, axis_a, axis_b,
                                   load3<S>(row + kRowAngularJacobianA * kLanes),
                                   load3<S>(row + kRowAngularJacobianB * kLanes));
  const auto sum = before + impulse;
  const auto pulls = S::less(sum, zero);
  impulse = S::select(pulls, zero - before, impulse);
  S::store(field, S::select(active, S::select(pulls, zero, sum), before));
  pair.apply_impulse(impulse, axis_a, axis_b, row + kRowAngularA * kLanes,
                     row + kRowAngularB * kLanes, active);
  pair.store();
  residual->add(impulse, inverse, active);
}

/// A row whose impulse is limited.
template <class S>
struct LimitedRow {
  Vec3Of<S> axis_a, axis_b, jacobian_a, jacobian_b;
  const Real *response_a, *response_b;
  typename S::Vec inverse, rhs;
};

/// Solves a row in the active lanes.
/// @param field address of its impulse, which is limited to [-upper, upper]
template <class S, class Pair, class Sum>
JFPX_ROW void solve_limited(const LimitedRow<S>& row, typename S::Vec upper,
                            typename S::Mask active, Real* field, Pair* pair, Sum* residual) {
  const auto lower = S::negate(upper);
  const auto before = S::load(field);
  auto impulse = row.rhs - before * S::set(0);
  impulse = pair->subtract_velocity(impulse, row.inverse, row.axis_a, row.axis_b, row.jacobian_a,
                                    row.jacobian_b);
  const auto sum = before + impulse;
  const auto below = S::less(sum, lower), above = S::less(upper, sum);
  impulse = S::select(below, lower - before, S::select(above, upper - before, impulse));
  const auto after = S::select(below, lower, S::select(above, upper, sum));
  S::store(field, S::select(active, after, before));
  pair->apply_impulse(impulse, row.axis_a, row.axis_b, row.response_a, row.response_b, active);
  residual->add(impulse, row.inverse, active);
}

/// Solves a friction row, whose impulse is limited by that of its contact.
template <class S, bool kFactors, class Moved = BothMoved, class Sum>
JFPX_ROW void solve_friction(const typename S::Id* ids, Real* velocities, const Real* factors,
                             const Real* contact, Real* row, Sum* residual) {
  constexpr int kLanes = S::kLanes;
  const auto pressure = S::load(contact + kRowImpulse * kLanes);
  const auto active = S::less(S::set(0), pressure);
  if (!S::any(active)) return;
  BodyVelocities<S, kFactors, Moved> pair(ids, velocities, factors);
  const auto axis = load3<S>(row + kRowAxis * kLanes);
  solve_limited<S>(
      {keep<S>(S::is_real(ids), axis), keep<S>(S::is_real(ids + kLanes), -axis),
       load3<S>(row + kRowAngularJacobianA * kLanes), load3<S>(row + kRowAngularJacobianB * kLanes),
       row + kRowAngularA * kLanes, row + kRowAngularB * kLanes,
       S::load(row + kRowInverse * kLanes), S::load(row + kRowRhs * kLanes)},
      S::load(row + kRowFriction * kLanes) * pressure, active, row + kRowImpulse * kLanes, &pair,
      residual);
  pair.store();
}

/// Solves the kRollingRows rolling and spinning friction rows of a contact: angular impulses that
/// are limited by the impulse of the contact.
template <class S, bool kFactors, class Moved = BothMoved, class Sum>
JFPX_ROW void solve_rolling_frictions(const typename S::Id* ids, Real* velocities,
                                      const Real* factors, const Real* contact, Real* rows,
                                      Sum* residual) {
  constexpr int kLanes = S::kLanes;
  const auto zero = S::set(0);
  const auto pressure = S::load(contact + kRowImpulse * kLanes);
  const auto pressed = S::less(zero, pressure);
  if (!S::any(pressed)) return;
  BodyVelocities<S, kFactors, Moved> pair(ids, velocities, factors);
  const Vec3Of<S> none = {zero, zero, zero};
  for (std::uint32_t t = 0; t < kRollingRows; ++t) {
    Real* const row = rows + t * kRollingFields * kLanes;
    const auto active = S::both(pressed, S::less(zero, S::load(row + kRollingPresent * kLanes)));
    if (!S::any(active)) continue;
    const auto strength = S::load(row + kRollingStrength * kLanes), limit = strength * pressure;
    const auto axis = load3<S>(row + kRollingAxis * kLanes);
    solve_limited<S>({none, -none,  // Bullet also multiplies by -0
                      -axis, axis, row + kRollingAngularA * kLanes, row + kRollingAngularB * kLanes,
                      S::load(row + kRollingInverse * kLanes), S::load(row + kRollingRhs * kLanes)},
                     S::select(S::less(strength, limit), strength, limit), active,
                     row + kRollingImpulse * kLanes, &pair, residual);
  }
  pair.store();
}

/// Applies the initial impulses of the rows to the bodies.
template <class S, bool kFactors, class Moved = BothMoved>
JFPX_ROW void warm_start(const typename S::Id* ids, Real* velocities, const Real* factors,
                         const Real* row) {
  constexpr int kLanes = S::kLanes;
  BodyVelocities<S, kFactors, Moved> pair(ids, velocities, factors);
  const auto n = load3<S>(row + kRowAxis * kLanes);
  pair.apply_impulse(S::load(row + kRowImpulse * kLanes), keep<S>(S::is_real(ids), n),
                     keep<S>(S::is_real(ids + kLanes), -n), row + kRowAngularA * kLanes,
                     row + kRowAngularB * kLanes, S::always());
  pair.store();
}

}  // namespace rows
}  // namespace JFPX_ABI
}  // namespace jfpx
