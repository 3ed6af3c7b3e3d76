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
  return absolute(x / length) < static_cast<Real>(1 << 20);
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
  *x = image_difference(given, 0, count, length);
  // The quotient is rounded.
  if (*x < -half) *x = image_difference(given, 0, --count, length);
  if (*x >= half) *x = image_difference(given, 0, ++count, length);
  return count;
}

/// A sphere in the cell whose radius covers the rounding of the reduction: if two spheres touch by
/// touch_at(), their reduced spheres or images touch. A coordinate that is displaced has an error
/// of less than epsilon length. The factor covers the roundings of both tests.
/// @param cells receives the displacements along the axes that repeat
/// @param sphere its centre is_reducible()
JFPX_HD inline SphereInstance reduced(SphereInstance sphere, const PeriodicCell& cell,
                                      ImageShift* cells) {
  *cells = {};
  Real error = 0;
  for (int k = 0; k < 3; ++k) {
    const auto axis = static_cast<std::size_t>(k);
    if (!cell.repeats[axis]) continue;
    (*cells)[axis] = reduce(&sphere.centre[k], cell.lengths[k]);
    if ((*cells)[axis] != 0) error += cell.lengths[k] * kEpsilon;
  }
  sphere.radius = (sphere.radius + error) * (1 + 16 * kEpsilon);
  return sphere;
}

JFPX_HD inline Real image_coordinate(Real x, std::int32_t shift, Real length) {
  return shift == 0 ? x : x + static_cast<Real>(shift) * length;
}
/// An image of a reduced() sphere. Its radius also covers the rounding of the image.
JFPX_HD inline SphereInstance image_of(SphereInstance sphere, const ImageShift& shift,
                                       const PeriodicCell& cell) {
  for (int k = 0; k < 3; ++k) {
    const std::int32_t displacement = shift[static_cast<std::size_t>(k)];
    if (displacement == 0) continue;
    Real& x = sphere.centre[k];
    x = image_coordinate(x, displacement, cell.lengths[k]);
    sphere.radius += cell.lengths[k] * (2 * kEpsilon);
  }
  return sphere;
}

/// Bit `code` is set for each image whose centre is at most `reach` outside the cell. The margin is
/// wider by 8 epsilon lengths, which covers the roundings of the image and of the comparison.
/// @param reach the largest sum of the radii of two reduced() spheres
JFPX_HD inline std::uint32_t near_images(const Vec3& centre, const PeriodicCell& cell, Real reach) {
  std::uint32_t codes = 1;
  for (int k = 0; k < 3; ++k) {
    std::uint32_t near = 2;  // bits of the shifts -1, 0 and 1
    if (cell.repeats[static_cast<std::size_t>(k)]) {
      const Real length = cell.lengths[k];
      const Real limit = length / 2 + reach + length * (8 * kEpsilon);
      if (image_coordinate(centre[k], -1, length) >= -limit) near |= 1;
      if (image_coordinate(centre[k], 1, length) <= limit) near |= 4;
    }
    // Each bit of the axes before becomes the three bits of this one.
    std::uint32_t product = 0;
    for (std::uint32_t bit = 0; bit < 9; ++bit) product |= (codes >> bit & 1u) * near << 3 * bit;
    codes = product;
  }
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

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
