/// What touches what, and how: the results of sphere collision.
#pragma once

#include <jfpx/shape.hpp>

#include <cstdint>
#include <span>

namespace jfpx {
inline namespace JFPX_ABI {

/// Index of a sphere in the caller's order.
using SphereIndex = std::uint32_t;

/// Two spheres to be tested against each other. The normal of the result points from b to a.
struct SpherePair {
  SphereIndex a = 0, b = 0;
  friend bool operator==(const SpherePair&, const SpherePair&) = default;
};

/// A touching pair of spheres, a < b. The points follow from it and sphere b: see point_on_b().
struct SphereContact {
  SphereIndex a = 0, b = 0;
  Vec3 normal;        ///< [-], unit, from b to a; (1,0,0) for coincident centres
  Real distance = 0;  ///< [m], <= 0: minus the penetration
  friend bool operator==(const SphereContact&, const SphereContact&) = default;
};

/// Result of one tested pair. Where `touching` is 0 the other fields are 0.
struct PairResult {
  Vec3 normal;                 ///< [-], unit, from b to a
  Real distance = 0;           ///< [m], <= 0; NaN where an input was NaN (as in Bullet)
  std::uint32_t touching = 0;  ///< 1 or 0
  friend bool operator==(const PairResult&, const PairResult&) = default;
};

/// A touching pair of a list of pairs.
struct PairContact {
  Vec3 normal;             ///< [-], unit, from b to a
  Real distance = 0;       ///< [m], <= 0; NaN where an input was NaN
  std::uint32_t pair = 0;  ///< its number in the list
  friend bool operator==(const PairContact&, const PairContact&) = default;
};

/// The deepest point of a on the surface of b, as Bullet computes it. `sphere_b` is sphere b.
JFPX_HD constexpr Vec3 point_on_b(const Vec3& normal, const SphereInstance& sphere_b) {
  return sphere_b.centre + normal * sphere_b.radius;
}
/// The middle of the overlap, on the line of centres (erratum E1).
JFPX_HD constexpr Vec3 middle_point(const Vec3& normal, Real distance,
                                    const SphereInstance& sphere_b) {
  return point_on_b(normal, sphere_b) + normal * (distance * Real(0.5));
}

/// Contacts sorted by (a, b), no pair twice. Valid until the next call on the collider.
using ContactSpan = std::span<const SphereContact>;

}  // namespace JFPX_ABI
}  // namespace jfpx
