/// Centres and images of a periodic cell: one arithmetic for the host and the device.
#pragma once

#include <jfpx/periodic.hpp>

#include <cmath>
#include <limits>

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

/// Whether the length is in the range in which images are finite.
JFPX_HD inline bool is_length(Real length) {
  return length > 0 && length <= std::numeric_limits<Real>::max() / 2;
}
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

/// Reduces one coordinate to [0, length), and returns the number of cells that it was displaced by.
JFPX_HD inline std::int32_t reduce(Real* x, Real length) {
#if defined(__CUDA_ARCH__)
  const Real cells = ::floor(*x / length);
#else
  const Real cells = std::floor(*x / length);
#endif
  *x -= cells * length;
  auto count = static_cast<std::int32_t>(cells);
  // The quotient and the difference are rounded.
  if (*x < 0) {
    *x += length;
    --count;
  }
  if (*x >= length) {
    *x -= length;
    ++count;
  }
  return count;
}
/// The same along all axes that repeat, for a centre that is_reducible().
JFPX_HD inline ImageShift reduce(Vec3* centre, const PeriodicCell& cell) {
  ImageShift cells{};
  for (int k = 0; k < 3; ++k) {
    const auto axis = static_cast<std::size_t>(k);
    if (cell.repeats[axis]) cells[axis] = reduce(&(*centre)[k], cell.lengths[k]);
  }
  return cells;
}

JFPX_HD inline Real image_coordinate(Real x, std::int32_t shift, Real length) {
  return shift == 0 ? x : x + static_cast<Real>(shift) * length;
}
JFPX_HD inline SphereInstance image_of(SphereInstance sphere, const ImageShift& shift,
                                       const PeriodicCell& cell) {
  for (int k = 0; k < 3; ++k) {
    Real& x = sphere.centre[k];
    x = image_coordinate(x, shift[static_cast<std::size_t>(k)], cell.lengths[k]);
  }
  return sphere;
}

/// Bit `code` is set for each image whose centre is at most `reach` outside the cell, which is at
/// most half a length. The margin is wider by 8 epsilon lengths. Touching centres are at most
/// reach * (1 + 5 epsilon) apart, because the sum of two radii and the distance are rounded; that
/// is 2.5 epsilon lengths more than `reach`, and the margin and its sum with a length lose less
/// than 2 by rounding.
JFPX_HD inline std::uint32_t near_images(const Vec3& centre, const PeriodicCell& cell, Real reach) {
  std::uint32_t codes = 1;
  for (int k = 0; k < 3; ++k) {
    std::uint32_t near = 2;  // bits of the shifts -1, 0 and 1
    if (cell.repeats[static_cast<std::size_t>(k)]) {
      const Real length = cell.lengths[k];
      const Real margin = reach + length * (8 * kEpsilon);
      if (image_coordinate(centre[k], -1, length) >= -margin) near |= 1;
      if (image_coordinate(centre[k], 1, length) <= length + margin) near |= 4;
    }
    // Each bit of the axes before becomes the three bits of this one.
    std::uint32_t product = 0;
    for (std::uint32_t bit = 0; bit < 9; ++bit) product |= (codes >> bit & 1u) * near << 3 * bit;
    codes = product;
  }
  return codes & ~(1u << kNoShift);
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
