/// Response of two bodies to one contact: impulse and projection (thesis 4.4.6, after Millington
/// 2007, chapters 14 and 15). The normal points to the side of body a.
#pragma once

#include <jfpx/math.hpp>

#include "src/collide/contact_basis.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Velocity of the point of a body at `arm` from its centre of mass.
JFPX_HD constexpr Vec3 point_velocity(const Vec3& velocity, const Vec3& angular_velocity,
                                      const Vec3& arm) {
  return velocity + cross(angular_velocity, arm);
}

/// Required change of the separating velocity of a contact [m/s]; none if <= 0.
/// @param separating       relative velocity along the normal; negative: closing
/// @param from_acceleration part of it due to this step's accelerations; without restitution,
///   because a body at rest would otherwise bounce on its weight
/// @param bounce_threshold lowest closing speed with restitution
JFPX_HD constexpr Real target_delta_velocity(Real separating, Real from_acceleration,
                                             Real restitution, Real bounce_threshold) {
  const Real impact = from_acceleration < 0 ? separating - from_acceleration : separating;
  // A factor of 0 or 1 instead of an unpredictable branch in the resolver's inner loop.
  const Real rebound = -restitution * impact;
  const bool bounces = (separating < -bounce_threshold) & (impact < 0);
  return static_cast<Real>(bounces) * rebound - separating;
}

/// Adds one body's contribution to the change of relative velocity per unit impulse, in contact
/// axes: 1/m on the diagonal, and (arm x e_i) . I^-1 (arm x e_j).
JFPX_HD constexpr void add_response(const ContactBasis& basis, const Vec3& arm, Real inverse_mass,
                                    const Mat3& inverse_inertia, Mat3* response) {
  const Vec3 lever[3] = {cross(arm, basis.normal), cross(arm, basis.tangent),
                         cross(arm, basis.bitangent)};
  for (int j = 0; j < 3; ++j) {
    const Vec3 angular = inverse_inertia * lever[j];
    for (int i = 0; i < 3; ++i) (*response)(i, j) += dot(lever[i], angular);
    (*response)(j, j) += inverse_mass;
  }
}

/// The impulse on body a, in contact axes: causes the target change of velocity along the normal
/// and stops sliding, or lies on Coulomb's friction cone if stopping exceeds `friction`.
/// @param response sum of add_response() over both bodies; response(0,0) > 0
/// @param target   change of velocity along the normal [m/s]
JFPX_HD inline Vec3 contact_impulse(const Mat3& response, const Vec3& velocity, Real target,
                                    Real friction) {
  const Real along_normal = response(0, 0);
  const Vec3 frictionless{target / along_normal, 0, 0};
  if (!(friction > 0)) return frictionless;
  // Scaled to about 1, so that the determinant does not overflow or underflow for any mass.
  Mat3 inverse;
  if (!invert(response * (Real(1) / along_normal), &inverse)) return frictionless;
  const Vec3 stop = inverse * Vec3{target, -velocity.y, -velocity.z} * (Real(1) / along_normal);
  const Real planar = square_root(stop.y * stop.y + stop.z * stop.z);
  if (!(planar > stop.x * friction)) return stop;

  Real y = stop.y / planar, z = stop.z / planar;
  // Friction opposes the sliding velocity that remains after the normal impulse alone. For spheres
  // this is the direction of `stop`; the rotation of a corner deflects `stop`, which would waste
  // friction.
  const Real normal_impulse = target / along_normal;
  const Real slip_y = velocity.y + response(1, 0) * normal_impulse;
  const Real slip_z = velocity.z + response(2, 0) * normal_impulse;
  const Real slip = square_root(slip_y * slip_y + slip_z * slip_z);
  if (-(y * slip_y + z * slip_z) < Real(0.999) * slip) {
    y = -slip_y / slip;
    z = -slip_z / slip;
  }
  const Real sliding = along_normal + (response(0, 1) * y + response(0, 2) * z) * friction;
  if (!(sliding > 0)) return frictionless;  // wedged: no impulse on the cone opens the contact
  const Real x = target / sliding;
  return {x, y * friction * x, z * friction * x};
}

/// Displacement of one body by a projection.
struct Displacement {
  Vec3 translation;  ///< [m]
  Vec3 rotation;     ///< [rad], world frame
};

/// Angular part of a body's inverse effective mass along the normal: (arm x n) . I^-1 (arm x n).
/// Zero for an arm along the normal, where the result of cross() is rounding error only.
JFPX_HD constexpr Real angular_inverse_effective_mass(const Vec3& normal, const Vec3& arm,
                                                      const Mat3& inverse_inertia) {
  const Vec3 lever = cross(arm, normal);
  const Real noise = 4 * kEpsilon;
  if (!(length_squared(lever) > noise * noise * length_squared(arm))) return 0;
  return dot(lever, inverse_inertia * lever);
}

/// Nonlinear projection (Millington 2007, 14.3): moves one body so that its contact point travels
/// depth * (its inverse effective mass / total) along the normal, by a rotation of at most
/// `angular_limit` and a translation for the rest.
/// @param depth signed: > 0 for body a, < 0 for body b
/// @param total sum of the inverse effective masses of both bodies, > 0
JFPX_HD inline Displacement projection(const Vec3& normal, const Vec3& arm, Real inverse_mass,
                                       const Mat3& inverse_inertia, Real depth, Real total,
                                       Real angular_limit) {
  const Real pseudo_impulse = depth / total;
  const Real angular = angular_inverse_effective_mass(normal, arm, inverse_inertia);
  Displacement d{normal * (inverse_mass * pseudo_impulse), {}};
  if (!(angular > 0)) return d;

  Real by_rotation = angular * pseudo_impulse;  // travel of the contact point
  d.rotation = inverse_inertia * cross(arm, normal) * (by_rotation / angular);
  const Real angle = length(d.rotation);
  if (angle > angular_limit) {
    const Real part = angular_limit / angle;
    by_rotation = by_rotation * part;
    d.rotation = d.rotation * part;
  }
  d.translation = normal * ((inverse_mass + angular) * pseudo_impulse - by_rotation);
  return d;
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
