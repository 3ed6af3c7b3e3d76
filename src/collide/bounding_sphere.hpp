/// Spheres around spheres (thesis 4.4.5), rounded so that they never lose what they enclose.
#pragma once

#include <jfpx/shape.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// A length from a point to another is wrong by 3 epsilon, and below this, where squares are
/// denormal, by less than it.
inline constexpr Real kLostLength = sizeof(Real) == 4 ? Real(0x1p-62) : Real(0x1p-510);

/// A radius that still encloses after the roundings of a distance, of a sum, and of the test
/// whether two bounds touch: if the spheres of two leaves touch in SphereCollider's arithmetic, len
/// <= (ra + rb)(1 + 5 eps) without rounding, then so do any two spheres around them whose radii
/// came from here. 3 + 5 + 3 epsilon are needed.
JFPX_HD constexpr Real safe_radius(Real radius) {
  return radius * (1 + 16 * kEpsilon) + kLostLength;
}

/// True only if b is inside a.
JFPX_HD inline bool encloses(const SphereInstance& a, const SphereInstance& b) {
  return safe_radius(length(b.centre - a.centre) + b.radius) <= a.radius;
}

/// The smallest sphere around both, but for rounding: one of them if it encloses the other.
JFPX_HD inline SphereInstance enclosing(const SphereInstance& a, const SphereInstance& b) {
  if (encloses(a, b)) return a;
  if (encloses(b, a)) return b;
  const Vec3 across = b.centre - a.centre;
  const Real distance = length(across);
  const Real reach = (distance + a.radius + b.radius) * Real(0.5);
  Vec3 centre = a.centre;
  if (distance > 0) centre = add_scaled(centre, across, (reach - a.radius) / distance);
  // From the centre as it was rounded.
  const Real to_a = length(a.centre - centre) + a.radius;
  const Real to_b = length(b.centre - centre) + b.radius;
  return {centre, safe_radius(to_a > to_b ? to_a : to_b)};
}

/// How much the square of a's radius grows when it takes b in (erratum E32).
JFPX_HD inline Real growth(const SphereInstance& a, const SphereInstance& b) {
  const Real radius = enclosing(a, b).radius;
  return radius * radius - a.radius * a.radius;
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
