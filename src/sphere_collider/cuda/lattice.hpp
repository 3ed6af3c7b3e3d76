/// Spheres on a lattice of whole numbers, so small that tensor cores compute with them exactly: a
/// cheap test that no touching pair fails.
#pragma once

#include "src/sphere_collider/cuda/grid_cells.hpp"
#include "src/sphere_collider/cuda/sphere_filter.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Coordinates on a lattice are whole numbers of at most this magnitude: a half-precision number
/// holds all of them, and their doubles.
inline constexpr Real kMaxOnLattice = 1023;

/// All four are whole numbers; the radius is rounded up.
struct LatticeSphere {
  float x, y, z, radius;
};

/// A box with a lattice.
struct Lattice {
  Vec3 origin;  ///< the middle of the box, nearly
  Real scale;   ///< lattice units a metre
};

/// For spheres with centres in [low, high] and radii of at most `largest`: the edges of the box are
/// at least twice as long as that, and longer than the roundings of coordinates.
JFPX_HD inline Lattice lattice_around(const Vec3& low, const Vec3& high, Real largest) {
  constexpr Real kRoundings = 8 * std::numeric_limits<Real>::epsilon();
  const auto longer = [](Real p, Real q) { return p > q ? p : q; };
  Lattice lattice;
  Real half = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const Real place = longer(absolute(low[axis]), absolute(high[axis]));
    const Real margin = fused(largest, Real(2), fused(place, kRoundings, kShortest));
    const Real first = moved(low[axis], -margin), last = moved(high[axis], margin);
    const Real middle = first * Real(0.5) + last * Real(0.5);
    lattice.origin[axis] = middle;
    half = longer(half, longer(last - middle, middle - first));
  }
  // Where a sum of radii may be infinite all spheres may touch: they are at one place on a lattice.
  const bool sums_are_finite = largest <= std::numeric_limits<Real>::max() / 2;
  lattice.scale = sums_are_finite ? kMaxOnLattice / half : 0;
  return lattice;
}

/// The nearest whole number to x * scale, if that is less than 2^22.
template <typename T>
JFPX_HD inline T to_whole(T x, T scale) {
  constexpr T kWhole =
      T(1.5) * static_cast<T>(std::uint64_t{1} << (std::numeric_limits<T>::digits - 1));
  return fused(x, scale, kWhole) - kWhole;
}

/// A sphere that the lattice is for. If detail::test_sphere_pair() says that two of them touch,
/// then |a - b| <= ra + rb holds on the lattice, too.
///
/// Proof, with u, t, D and s as in sphere_filter.hpp. Spheres that touch have D <= s^2 (1+9u) + 8t,
/// and so a distance of at most d = s (1+6u) + sqrt(8t) (1+u) <= s (1+7u) + kShortest. A coordinate
/// on the lattice is rounded twice: in the offset, by at most 1023u lattice units, and to a whole
/// number, by at most 1/2. So two centres are no farther apart there than
/// scale * d + sqrt(3) (1 + 2046u) < scale * d + 2 * 0.8663. The sum of both radii there is at
/// least scale * ((ra + rb) (1+14u) + kShortest) + 2 * (1.3666 - 2048u - 1/2), as rounding to a
/// whole number takes 1/2 away at most; and s <= (ra + rb) (1+u).
JFPX_HD inline LatticeSphere on_lattice(const Lattice& lattice, const SphereInstance& s) {
  constexpr Real kSlack = 1 + 8 * std::numeric_limits<Real>::epsilon();
  const Vec3 offset = s.centre - lattice.origin;
  const Real more = fused(kShortest, lattice.scale, Real(1.3666));
  const Real radius = fused(s.radius * lattice.scale, kSlack, more);
  return {static_cast<float>(to_whole(offset.x, lattice.scale)),
          static_cast<float>(to_whole(offset.y, lattice.scale)),
          static_cast<float>(to_whole(offset.z, lattice.scale)),
          static_cast<float>(to_whole(radius, Real(1)))};
}

/// The square of the distance of the centres less that of the sum of the radii, and less 1:
/// negative if the spheres may touch. It is the sum of products of two rows of kTerms numbers: all
/// of them whole numbers that half precision holds (up to 2048), so that the products are exact;
/// and no partial sum, in whatever order, reaches 2^24 in magnitude (2 * 3 * 1023^2 + 2 * 1024^2
/// for the products of coordinates and of radii, twice 3 * 1023^2 + 2048 for the others), so that
/// single precision adds them without errors.
inline constexpr unsigned kTerms = 8;
struct LatticeTerms {
  float values[kTerms];
};
/// A whole number below 2^22 in two parts: one to multiply by kUpperPart, one to add.
inline constexpr float kUpperPart = 2048;
struct LatticeParts {
  float upper, lower;
};
JFPX_HD inline LatticeParts parts_of(float whole) {
  const float upper = to_whole(whole, 1 / kUpperPart);
  return {upper, fused(upper, -kUpperPart, whole)};
}
/// The square of the distance from the origin less that of the radius.
JFPX_HD inline float power_of_origin(const LatticeSphere& s) {
  return fused(s.x, s.x, fused(s.y, s.y, fused(s.z, s.z, -(s.radius * s.radius))));
}
/// Of the first sphere.
JFPX_HD inline LatticeTerms row_terms(const LatticeSphere& a) {
  const LatticeParts power = parts_of(power_of_origin(a) - 1);
  return {{-2 * a.x, -2 * a.y, -2 * a.z, -2 * a.radius, kUpperPart, 1, power.upper, power.lower}};
}
/// Of the second one.
JFPX_HD inline LatticeTerms column_terms(const LatticeSphere& b) {
  const LatticeParts power = parts_of(power_of_origin(b));
  return {{b.x, b.y, b.z, b.radius, power.upper, power.lower, kUpperPart, 1}};
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
