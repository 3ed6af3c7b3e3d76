/// Searches in a periodic cell: ids of images, and the exact test of candidates.
#pragma once

#include "src/sphere_collider/cuda/search.cuh"
#include "src/sphere_collider/cuda/sphere_filter.hpp"
#include "src/sphere_collider/periodic_cell.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Whether a sphere may be in the cell.
__device__ inline bool is_valid_in(const PeriodicCell& cell, const SphereInstance& s) {
  return is_valid(s) && detail::fits(cell, s.radius) && detail::is_reducible(s.centre, cell);
}

/// The id of sphere `i` of the input.
__device__ inline std::uint32_t id_of(const SphereInput& input, std::uint64_t i) {
  const PeriodicInput& periodic = input.periodic;
  return i < periodic.spheres ? static_cast<std::uint32_t>(i)
                              : periodic.images[i - periodic.spheres];
}

/// The bound of a filter below which spheres also touch as given, where `bound` is that below which
/// the spheres of the input do: the squared distance of reduced spheres must be less than the
/// squared sum S of their radii by this more.
///
/// Proof, with u = epsilon/2, m the margin of a radius, e the error of a distance, and L the value
/// `least` of PeriodicSearch::input_on_device(), which is at least 2m + e. The result is at least
/// bound + 80u S^2 + 2.1 L S, hence D < S^2 - 80u S^2 - 2.1 L S for the squared distance D of the
/// reduced spheres, and their distance is less than S - 40u S - 1.05 L. As S is at most
/// (s + 2m)(1 + 19u), where s is the sum of the given radii, the given distance is less than
/// s - 20u S: the exact test, which rounds by less than 7u, finds a contact.
/// @param largest_sum of the radii of two spheres of the input
template <bool kPeriodic>
__device__ Real doubt_of(const PeriodicInput& periodic, Real bound, Real largest_sum) {
  if constexpr (!kPeriodic) return bound;
  return bound + largest_sum * fused(largest_sum, periodic.relative_slack, periodic.slack);
}

/// The test detail::touch_at() of two given spheres a < b, and of the image of b near `image`. Its
/// shift is one lower along the axis `lower`, unless that is -1. Loops are not unrolled and nothing
/// is kept, because a search has few registers left for this rare test.
__device__ inline bool touches_at(const PeriodicSpheres& known, const SphereInstance* reduced,
                                  std::uint32_t a, std::uint32_t b, const Vec3& image, int lower) {
  const SphereInstance &sa = known.given[a], &sb = known.given[b];
  Real squares = 0;
#pragma unroll 1
  for (int k = 0; k < 3; ++k) {
    const Real x = sa.centre[k], y = sb.centre[k];
    if (!known.cell.repeats[static_cast<std::size_t>(k)]) {
      squares += (x - y) * (x - y);
      continue;
    }
    const Real length = known.cell.lengths[k], displaced = image[k] - reduced[b].centre[k];
    std::int32_t shift = detail::nearest_shift(displaced, length);
    if (k == lower) {
      if (shift < 0) return false;  // no such image
      --shift;
    }
#pragma unroll 1
    for (int i = 0; i < 2; ++i) {
      Real in_cell = i == 0 ? x : y;
      const std::int32_t cells = detail::reduce(&in_cell, length);
      shift += i == 0 ? cells : -cells;
    }
    const Real difference = detail::image_difference(x, y, shift, length);
    squares += difference * difference;
  }
  return !(square_root(squares) > sa.radius + sb.radius);
}

/// Whether two given spheres a < b touch through the image of b near `image`, and through none with
/// a lower shift: the result of detail::touch_in_cell(). Two images that touch are half a length
/// from the sphere along an axis, and at its coordinate along the others.
__device__ inline bool touches_image(const PeriodicSpheres& known, const SphereInstance* reduced,
                                     std::uint32_t a, std::uint32_t b, const Vec3& image) {
  const Real sum = known.given[a].radius + known.given[b].radius;
#pragma unroll 1
  for (int lower = -1; lower < 3; ++lower) {
    if (lower >= 0) {
      if (!known.cell.repeats[static_cast<std::size_t>(lower)]) continue;
      if (!detail::may_touch_twice(sum, known.cell.lengths[lower])) continue;
    }
    const bool expected = lower < 0;
    if (touches_at(known, reduced, a, b, image, lower) != expected) return false;
  }
  return true;
}

/// The exact test of sphere a, and of sphere b > a or its image, where the search has found it.
template <bool kPeriodic>
__device__ bool touch_exactly(const SphereInput& input, std::uint32_t a, const SphereInstance& self,
                              std::uint32_t b, const SphereInstance& other) {
  if constexpr (kPeriodic) {
    return touches_image(*input.periodic.known, input.spheres, a, b, other.centre);
  } else {
    return touch(self, other);
  }
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
