/// Centres and images of a periodic cell: one arithmetic for the host and the device.
#pragma once

#include <jfpx/periodic.hpp>

#include "src/collide/sphere_pair.hpp"

#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// An image of a sphere in the cell.
struct PeriodicImage {
  SphereIndex sphere;
  std::uint32_t code;  ///< see shift_of()
};

/// The 27 shifts of -1, 0 or 1 cells along each axis, in lexicographic order.
inline constexpr std::uint32_t kShifts = 27, kNoShift = 13;
JFPX_HD inline ImageShift shift_of(std::uint32_t code) {
  const auto c = static_cast<std::int32_t>(code);
  return {c / 9 - 1, c / 3 % 3 - 1, c % 3 - 1};
}

/// Squares of shorter lengths underflow: 2^-73, in double 2^-536.
inline constexpr auto kShortest = static_cast<Real>(sizeof(Real) == 4 ? 0x1p-73 : 0x1p-536);

/// Largest length of a cell: squares of distances in a few cells are finite.
inline constexpr auto kLongestPeriod = static_cast<Real>(sizeof(Real) == 4 ? 0x1p60 : 0x1p508);
JFPX_HD inline bool is_length(Real length) { return length > 0 && length <= kLongestPeriod; }
/// Whether spheres of this radius may be in the cell.
JFPX_HD inline bool fits(const PeriodicCell& cell, Real radius) {
  bool result = true;
  for (int k = 0; k < 3; ++k) {
    const Real length = cell.lengths[k];
    const bool repeats = cell.repeats[static_cast<std::size_t>(k)];
    result = result && (!repeats || (is_length(length) && radius <= length / 4));
  }
  return result;
}

/// Up to this number of cells, the reduction is off by less than a length in either precision.
JFPX_HD inline bool is_reducible(Real x, Real length) {
  return absolute(x) < length || absolute(x / length) < static_cast<Real>(1 << 20);
}
JFPX_HD inline bool is_reducible(const Vec3& centre, const PeriodicCell& cell) {
  bool result = true;
  for (int k = 0; k < 3; ++k) {
    const bool repeats = cell.repeats[static_cast<std::size_t>(k)];
    result = result && (!repeats || is_reducible(centre[k], cell.lengths[k]));
  }
  return result;
}

/// The sum of x and y, whose rounding error is added to *error (Knuth 1969).
JFPX_HD inline double sum_with_error(double x, double y, double* error) {
  const double sum = x + y, of_y = sum - x;
  *error += (x - (sum - of_y)) + (y - of_y);
  return sum;
}
/// a - (b + shift * length) in double, as if it were rounded once, apart from errors of 2^-100 of
/// the terms.
JFPX_HD inline double exact_image_difference(Real a, Real b, std::int32_t shift, Real length) {
  // Both products are exact: the upper part of the length has 27 bits, and a shift has at most 22
  // (Dekker 1971).
  const double product = static_cast<double>(length) * ((1 << 26) + 1);
  const double upper = product - (product - static_cast<double>(length));
  double error = 0;
  double sum = sum_with_error(a, -static_cast<double>(b), &error);
  sum = sum_with_error(sum, -static_cast<double>(shift) * upper, &error);
  sum = sum_with_error(sum, -static_cast<double>(shift) * (static_cast<double>(length) - upper),
                       &error);
  return sum + error;
}
/// The same, rounded to Real.
JFPX_HD inline Real image_difference(Real a, Real b, std::int32_t shift, Real length) {
  if (shift == 0) return a - b;
  return static_cast<Real>(exact_image_difference(a, b, shift, length));
}

/// x - shift * length, rounded once: on the device, where that is an instruction.
JFPX_HD inline Real displaced(Real x, std::int32_t shift, Real length) {
#if defined(__CUDA_ARCH__)
  return ::fma(-static_cast<Real>(shift), length, x);
#else
  return image_difference(x, 0, shift, length);
#endif
}

/// Reduces one coordinate to about [-length/2, length/2), and returns the number of cells that it
/// was displaced by. A coordinate in this range does not change; another one is rounded once.
JFPX_HD inline std::int32_t reduce(Real* x, Real length) {
  const Real half = length / 2, given = *x;
  if (given >= -half && given < half) return 0;
#if defined(__CUDA_ARCH__)
  const Real cells = ::floor(given / length + Real(0.5));
#else
  const Real cells = std::floor(given / length + Real(0.5));
#endif
  auto count = static_cast<std::int32_t>(cells);
  *x = displaced(given, count, length);
  // The quotient is rounded.
  if (*x < -half) *x = displaced(given, --count, length);
  if (*x >= half) *x = displaced(given, ++count, length);
  return count;
}

/// Bounds of the errors of reduced centres and images in a cell.
struct CellErrors {
  Real distance;  ///< of the distance between a reduced centre and another one or its image
  Real margin;    ///< of a radius: see reduced()
};
/// Proof, with u = epsilon/2. A coordinate that is displaced has an error of at most u L/2, and one
/// of an image another one of 1.01 u L, as near_images() are less than 1.01 L away, unless the
/// margin of another axis exceeds this length, which then has no part in the norm. So a difference
/// of coordinates has an error of at most 2.1 u L along each axis.
JFPX_HD inline CellErrors errors_in(const PeriodicCell& cell) {
  Real squares = 0;
  bool repeats = false;
  for (int k = 0; k < 3; ++k) {
    if (!cell.repeats[static_cast<std::size_t>(k)]) continue;
    repeats = true;
    squares += cell.lengths[k] * cell.lengths[k];
  }
  if (!repeats) return {0, 0};
  const Real distance = square_root(squares) * (Real(1.1) * kEpsilon) + kShortest;
  return {distance, distance * Real(0.55) + kShortest};
}

JFPX_HD inline Real reduced_radius(Real radius, const CellErrors& errors) {
  return errors.margin > 0 ? (radius + errors.margin) * (1 + 8 * kEpsilon) : radius;
}
/// A sphere in the cell. Its radius is larger by a margin that is the same for all spheres, so that
/// any two spheres that touch by touch_at() touch as reduced spheres or images, too. Proof: they
/// have a true distance of at most s (1 + 6u) plus what underflows, where s is the sum of their
/// radii, and the distance of the reduced ones exceeds it by at most `errors.distance`; the factor
/// covers the roundings of both tests.
/// @param cells receives the displacements along the axes that repeat
/// @param sphere its centre is_reducible()
JFPX_HD inline SphereInstance reduced(SphereInstance sphere, const PeriodicCell& cell,
                                      const CellErrors& errors, ImageShift* cells) {
  *cells = {};
  for (int k = 0; k < 3; ++k) {
    const auto axis = static_cast<std::size_t>(k);
    if (cell.repeats[axis]) (*cells)[axis] = reduce(&sphere.centre[k], cell.lengths[k]);
  }
  sphere.radius = reduced_radius(sphere.radius, errors);
  return sphere;
}

JFPX_HD inline Real image_coordinate(Real x, std::int32_t shift, Real length) {
  return shift == 0 ? x : x + static_cast<Real>(shift) * length;
}
/// An image of a reduced() sphere.
JFPX_HD inline SphereInstance image_of(SphereInstance sphere, const ImageShift& shift,
                                       const PeriodicCell& cell) {
  for (int k = 0; k < 3; ++k) {
    Real& x = sphere.centre[k];
    x = image_coordinate(x, shift[static_cast<std::size_t>(k)], cell.lengths[k]);
  }
  return sphere;
}

/// Bit `code` is set for each image whose centre is at most `reach` outside the cell. The margin is
/// wider by 8 epsilon lengths, which covers the roundings of the image and of the comparison.
/// @param reach the largest sum of the radii of two reduced() spheres
JFPX_HD inline std::uint32_t near_images(const Vec3& centre, const PeriodicCell& cell, Real reach) {
  std::uint32_t near[3];  // bits 0 to 2: the shifts -1, 0 and 1
  for (int k = 0; k < 3; ++k) {
    near[k] = 2;
    if (!cell.repeats[static_cast<std::size_t>(k)]) continue;
    const Real length = cell.lengths[k];
    const Real limit = length / 2 + reach + length * (8 * kEpsilon);
    if (image_coordinate(centre[k], -1, length) >= -limit) near[k] |= 1;
    if (image_coordinate(centre[k], 1, length) <= limit) near[k] |= 4;
  }
  // Each bit of y becomes the three bits of z, and each bit of x the nine of both.
  const std::uint32_t every_third = (near[1] & 1) | (near[1] & 2) << 2 | (near[1] & 4) << 4;
  const std::uint32_t every_ninth = (near[0] & 1) | (near[0] & 2) << 8 | (near[0] & 4) << 16;
  const std::uint32_t codes = near[2] * every_third * every_ninth;
  return codes & ~(1u << kNoShift);
}

/// Tests a sphere with the image of another one, from the given centres: the difference of the
/// centres is computed before the image, so that neither the size of the cell nor the reduction
/// affects the result. Without a shift, it is that of test_sphere_pair().
JFPX_HD inline PairResult touch_at(const SphereInstance& a, const SphereInstance& b,
                                   const ImageShift& shift, const PeriodicCell& cell) {
  SphereInstance relative{{}, a.radius};
  for (int k = 0; k < 3; ++k) {
    const std::int32_t displacement = shift[static_cast<std::size_t>(k)];
    const Real length = displacement == 0 ? Real(0) : cell.lengths[k];
    relative.centre[k] = image_difference(a.centre[k], b.centre[k], displacement, length);
  }
  return test_sphere_pair(relative, {{}, b.radius});
}

/// A pair of spheres that touches in a cell.
struct ImageTouch {
  PairResult pair;  ///< by touch_at()
  ImageShift shift;
};

/// Tests two spheres in a cell. If they touch through several images, the result is that with the
/// lowest shift in lexicographic order.
///
/// An image is tested unless its distance along an axis exceeds `limit`. Proof, with u = epsilon/2:
/// reduced centres are off by at most u L/2 each, and the two subtractions by 1.5 u L and 1.1 u L,
/// so that the distance along an axis has an error of less than 4 u L. Spheres that touch have a
/// true distance of at most s (1 + 6u) plus what underflows in squares (sphere_filter.hpp).
JFPX_HD inline ImageTouch touch_in_cell(const SphereInstance& a, const SphereInstance& b,
                                        const PeriodicCell& cell) {
  const Real reach = (a.radius + b.radius) * (1 + 8 * kEpsilon) + kShortest;
  ImageShift between{};  // what the reduction displaced a by, minus the same of b
  bool near[3][3];       // images with the shifts -1, 0 and 1 along each axis
  for (int k = 0; k < 3; ++k) {
    near[k][0] = near[k][2] = false;
    near[k][1] = true;
    const auto axis = static_cast<std::size_t>(k);
    if (!cell.repeats[axis]) continue;
    const Real length = cell.lengths[k], limit = reach + length * (4 * kEpsilon);
    Real x = a.centre[k], y = b.centre[k];
    between[axis] = reduce(&x, length);
    between[axis] -= reduce(&y, length);
    const Real difference = x - y;
    near[k][0] = absolute(difference + length) <= limit;
    near[k][1] = absolute(difference) <= limit;
    near[k][2] = absolute(difference - length) <= limit;
  }
  for (int i = 0; i < 3; ++i) {
    if (!near[0][i]) continue;
    for (int j = 0; j < 3; ++j) {
      if (!near[1][j]) continue;
      for (int k = 0; k < 3; ++k) {
        if (!near[2][k]) continue;
        const ImageShift shift{between[0] + i - 1, between[1] + j - 1, between[2] + k - 1};
        const PairResult pair = touch_at(a, b, shift, cell);
        if (pair.touching != 0) return {pair, shift};
      }
    }
  }
  return {};
}

/// The shift of the image of b that is nearest to a, for reduced coordinates.
/// @param difference a - b
JFPX_HD inline std::int32_t nearest_shift(Real difference, Real length) {
  const Real half = length / 2;
  return difference > half ? 1 : difference < -half ? -1 : 0;
}

/// Whether two spheres may touch through two images, which are half a length away on both sides.
/// @param sum of their radii
JFPX_HD inline bool may_touch_twice(Real sum, Real length) {
  return !(sum + 2 * kShortest < length * (Real(0.5) - 4 * kEpsilon));
}
/// The shift of touch_in_cell() for two spheres that touch. Unless the sum of the radii is half a
/// length, the image that touches is the nearest one along each axis.
JFPX_HD inline ImageShift shift_of_touching(const SphereInstance& a, const SphereInstance& b,
                                            const PeriodicCell& cell) {
  ImageShift result{};
  for (int k = 0; k < 3; ++k) {
    const auto axis = static_cast<std::size_t>(k);
    if (!cell.repeats[axis]) continue;
    const Real length = cell.lengths[k];
    if (may_touch_twice(a.radius + b.radius, length)) return touch_in_cell(a, b, cell).shift;
    Real x = a.centre[k], y = b.centre[k];
    result[axis] = reduce(&x, length);
    result[axis] -= reduce(&y, length);
    result[axis] += nearest_shift(x - y, length);
  }
  return result;
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
