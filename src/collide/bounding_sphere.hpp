/// Bounding spheres of spheres (thesis 4.4.5), rounded so that they stay conservative.
#pragma once

#include <jfpx/shape.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// [m], upper bound of the absolute error of a shorter distance, whose squares are denormal. The
/// relative error of longer distances is at most 3 epsilon.
inline constexpr Real kLostLength = sizeof(Real) == 4 ? Real(0x1p-62) : Real(0x1p-510);

/// Enlarges a radius to compensate the rounding errors of a distance, of a sum and of the overlap
/// test of two bounds. If the spheres of two leaves touch in SphereCollider's arithmetic, that is,
/// len <= (ra + rb)(1 + 5 eps) in exact arithmetic, then all pairs of their bounding spheres with
/// radii from this function overlap too. This requires 3 + 5 + 3 epsilon.
JFPX_HD constexpr Real safe_radius(Real radius) {
  return radius * (1 + 16 * kEpsilon) + kLostLength;
}

/// True only if b is inside a. Conservative: may be false if b fits exactly.
JFPX_HD inline bool encloses(const SphereInstance& a, const SphereInstance& b) {
  return safe_radius(length(b.centre - a.centre) + b.radius) <= a.radius;
}

/// The smallest sphere that encloses both, up to rounding. If one sphere encloses the other, it is
/// returned unchanged.
JFPX_HD inline SphereInstance enclosing(const SphereInstance& a, const SphereInstance& b) {
  if (encloses(a, b)) return a;
  if (encloses(b, a)) return b;
  const Vec3 across = b.centre - a.centre;
  const Real distance = length(across);
  const Real radius = (distance + a.radius + b.radius) * Real(0.5);
  Vec3 centre = a.centre;
  if (distance > 0) centre = add_scaled(centre, across, (radius - a.radius) / distance);
  // Distances from the rounded centre.
  const Real to_a = length(a.centre - centre) + a.radius;
  const Real to_b = length(b.centre - centre) + b.radius;
  return {centre, safe_radius(to_a > to_b ? to_a : to_b)};
}

/// Increase of the squared radius of a by enlarging it to enclose b (erratum E32).
JFPX_HD inline Real growth(const SphereInstance& a, const SphereInstance& b) {
  const Real radius = enclosing(a, b).radius;
  return radius * radius - a.radius * a.radius;
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
