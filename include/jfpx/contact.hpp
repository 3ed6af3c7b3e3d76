/// Pairs and contacts of spheres: inputs and results of sphere collision.
#pragma once

#include <jfpx/shape.hpp>

#include <cstdint>
#include <span>

namespace jfpx {
inline namespace JFPX_ABI {

/// Index of a sphere in the caller's order.
using SphereIndex = std::uint32_t;

/// Two spheres to be tested. The normal of the result points from b to a.
struct SpherePair {
  SphereIndex a = 0, b = 0;
  friend bool operator==(const SpherePair&, const SpherePair&) = default;
};

/// A touching pair of spheres, a < b. point_on_b() computes the contact point.
struct SphereContact {
  SphereIndex a = 0, b = 0;
  Vec3 normal;        ///< [-], unit, from b to a; (1,0,0) for coincident centres
  Real distance = 0;  ///< [m], <= 0: negative penetration depth
  friend bool operator==(const SphereContact&, const SphereContact&) = default;
};

/// Result of a tested pair, see cuda::DeviceSphereCollider::test_pairs(). If `touching` is 0, the
/// other fields are 0.
struct PairResult {
  Vec3 normal;                 ///< [-], unit, from b to a
  Real distance = 0;           ///< [m], <= 0; NaN if an input is NaN, as in Bullet
  std::uint32_t touching = 0;  ///< 1 or 0
  friend bool operator==(const PairResult&, const PairResult&) = default;
};

/// A touching pair of a list of pairs, see SphereCollider::find_touching().
struct PairContact {
  Vec3 normal;             ///< [-], unit, from b to a
  Real distance = 0;       ///< [m], <= 0; NaN if an input is NaN
  std::uint32_t pair = 0;  ///< index in the list
  friend bool operator==(const PairContact&, const PairContact&) = default;
};

/// Contact point on the surface of b [m], computed as in Bullet. `sphere_b` is sphere b.
JFPX_HD constexpr Vec3 point_on_b(const Vec3& normal, const SphereInstance& sphere_b) {
  return sphere_b.centre + normal * sphere_b.radius;
}
/// Midpoint of the overlap on the line of centres [m] (erratum E1).
JFPX_HD constexpr Vec3 middle_point(const Vec3& normal, Real distance,
                                    const SphereInstance& sphere_b) {
  return point_on_b(normal, sphere_b) + normal * (distance * Real(0.5));
}

/// Contacts sorted by (a, b), without duplicates. Valid until the next call of the collider.
using ContactSpan = std::span<const SphereContact>;

}  // namespace JFPX_ABI
}  // namespace jfpx
