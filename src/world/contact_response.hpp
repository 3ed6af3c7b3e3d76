/// What one contact does to two bodies: impulse and projection (thesis 4.4.6, after Millington
/// 2007, chapters 14 and 15). Body a is on the side that the normal points to.
#pragma once

#include <jfpx/math.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Right-handed orthonormal axes of a contact; the first is the normal.
struct ContactBasis {
  Vec3 normal, tangent, bitangent;
};

/// `normal` is a unit vector. The tangent lies across the smaller of n.x and n.y, so that its
/// length before scaling is at least 0.7 (erratum E4).
JFPX_HD inline ContactBasis contact_basis(const Vec3& normal) {
  Vec3 tangent;
  if (absolute(normal.x) > absolute(normal.y)) {
    const Real k = Real(1) / square_root(normal.z * normal.z + normal.x * normal.x);
    tangent = {normal.z * k, 0, -normal.x * k};
  } else {
    const Real k = Real(1) / square_root(normal.z * normal.z + normal.y * normal.y);
    tangent = {0, -normal.z * k, normal.y * k};
  }
  return {normal, tangent, cross(normal, tangent)};
}

JFPX_HD constexpr Vec3 to_contact(const ContactBasis& basis, const Vec3& v) {
  return {dot(basis.normal, v), dot(basis.tangent, v), dot(basis.bitangent, v)};
}
JFPX_HD constexpr Vec3 to_world(const ContactBasis& basis, const Vec3& v) {
  return basis.normal * v.x + basis.tangent * v.y + basis.bitangent * v.z;
}

/// Velocity of the point of a body that is at `arm` from its centre of mass.
JFPX_HD constexpr Vec3 point_velocity(const Vec3& velocity, const Vec3& angular_velocity,
                                      const Vec3& arm) {
  return velocity + cross(angular_velocity, arm);
}

/// The change of separating velocity that a contact wants [m/s]; nothing to do where it is <= 0.
/// @param separating       relative velocity along the normal; negative: closing
/// @param from_acceleration the part of it that this step's accelerations made; a body at rest
///   would bounce on its weight if restitution applied to it
/// @param slowest          closing slower than this does not bounce
JFPX_HD constexpr Real target_delta_velocity(Real separating, Real from_acceleration,
                                             Real restitution, Real slowest) {
  const Real hit = from_acceleration < 0 ? separating - from_acceleration : separating;
  // By a factor of 0 or 1: a branch could not be foretold, and this is the resolver's inner loop.
  const Real back = -restitution * hit;
  const bool bounces = (separating < -slowest) & (hit < 0);
  return static_cast<Real>(bounces) * back - separating;
}

/// Adds what one body contributes to the change of relative velocity per unit impulse, in contact
/// axes: 1/m on the diagonal, and (arm x e_i) . I^-1 (arm x e_j).
JFPX_HD constexpr void add_response(const ContactBasis& basis, const Vec3& arm, Real inverse_mass,
                                    const Mat3& inverse_inertia, Mat3* response) {
  const Vec3 lever[3] = {cross(arm, basis.normal), cross(arm, basis.tangent),
                         cross(arm, basis.bitangent)};
  for (int j = 0; j < 3; ++j) {
    const Vec3 turned = inverse_inertia * lever[j];
    for (int i = 0; i < 3; ++i) (*response)(i, j) += dot(lever[i], turned);
    (*response)(j, j) += inverse_mass;
  }
}

/// The impulse on body a, in contact axes: gives the wanted change along the normal and stops
/// sliding, or slides inside Coulomb's cone when that takes more than `friction` allows.
/// @param response sum of add_response() over both bodies; response(0,0) > 0
JFPX_HD inline Vec3 contact_impulse(const Mat3& response, const Vec3& velocity, Real wanted,
                                    Real friction) {
  const Real along_normal = response(0, 0);
  const Vec3 frictionless{wanted / along_normal, 0, 0};
  if (!(friction > 0)) return frictionless;
  // Scaled to about 1, so that the determinant neither overflows nor vanishes for any mass.
  Mat3 inverse;
  if (!invert(response * (Real(1) / along_normal), &inverse)) return frictionless;
  const Vec3 stop = inverse * Vec3{wanted, -velocity.y, -velocity.z} * (Real(1) / along_normal);
  const Real planar = square_root(stop.y * stop.y + stop.z * stop.z);
  if (!(planar > stop.x * friction)) return stop;

  Real y = stop.y / planar, z = stop.z / planar;
  // Friction acts against the sliding that the push along the normal alone would leave. For spheres
  // that is where `stop` points; a corner's turning pulls `stop` aside, and friction would be lost.
  const Real push = wanted / along_normal;
  const Real slip_y = velocity.y + response(1, 0) * push;
  const Real slip_z = velocity.z + response(2, 0) * push;
  const Real slip = square_root(slip_y * slip_y + slip_z * slip_z);
  if (-(y * slip_y + z * slip_z) < Real(0.999) * slip) {
    y = -slip_y / slip;
    z = -slip_z / slip;
  }
  const Real sliding = along_normal + (response(0, 1) * y + response(0, 2) * z) * friction;
  if (!(sliding > 0)) return frictionless;  // wedged: no impulse on the cone opens the contact
  const Real x = wanted / sliding;
  return {x, y * friction * x, z * friction * x};
}

/// What a projection does to one body.
struct Displacement {
  Vec3 shift;  ///< [m]
  Vec3 turn;   ///< [rad], world frame
};

/// How much the turning of a body yields to a push along the normal: (arm x n) . I^-1 (arm x n).
/// Zero for an arm along the normal, where cross() would leave rounding errors only.
JFPX_HD constexpr Real angular_inverse_effective_mass(const Vec3& normal, const Vec3& arm,
                                                      const Mat3& inverse_inertia) {
  const Vec3 lever = cross(arm, normal);
  const Real noise = 4 * kEpsilon;
  if (!(length_squared(lever) > noise * noise * length_squared(arm))) return 0;
  return dot(lever, inverse_inertia * lever);
}

/// Nonlinear projection (Millington 2007, 14.3): moves one body so that its contact point travels
/// depth * (its inverse_effective_mass / total inverse_effective_mass) along the normal, by turning
/// no further than `angular_limit` and shifting for the rest.
/// @param depth       signed: > 0 for body a, < 0 for body b
/// @param total_yield inverse masses plus angular yields of both bodies, > 0
JFPX_HD inline Displacement projection(const Vec3& normal, const Vec3& arm, Real inverse_mass,
                                       const Mat3& inverse_inertia, Real depth, Real total_yield,
                                       Real angular_limit) {
  const Real per_yield = depth / total_yield;
  const Real inverse_effective_mass = angular_inverse_effective_mass(normal, arm, inverse_inertia);
  Displacement d{normal * (inverse_mass * per_yield), {}};
  if (!(inverse_effective_mass > 0)) return d;

  Real turned = inverse_effective_mass * per_yield;
  d.turn = inverse_inertia * cross(arm, normal) * (turned / inverse_effective_mass);
  const Real angle = length(d.turn);
  if (angle > angular_limit) {
    const Real part = angular_limit / angle;
    turned = turned * part;
    d.turn = d.turn * part;
  }
  d.shift = normal * ((inverse_mass + inverse_effective_mass) * per_yield - turned);
  return d;
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
