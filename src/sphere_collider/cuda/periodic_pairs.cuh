/// Searches in a periodic cell: ids with shift codes, shifts, and the exact test of candidates.
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
  return input.is_periodic() ? input.periodic.ids[i] : static_cast<std::uint32_t>(i);
}
/// Whether an id of a search in a periodic cell is that of an image.
__device__ inline bool is_image(std::uint32_t id) { return (id & 1) != 0; }
/// The index of the sphere with an id, or of the sphere that the image is of.
template <bool kPeriodic>
__device__ std::uint32_t index_of(const SphereInput& input, std::uint32_t id) {
  return kPeriodic ? id >> input.periodic.index_bit : id;
}
/// The highest id with the same index. Ids with a higher index are higher.
template <bool kPeriodic>
__device__ std::uint32_t last_id_of(const SphereInput& input, std::uint32_t id) {
  return kPeriodic ? id | ((1u << input.periodic.index_bit) - 1) : id;
}

/// The shift code of a sphere or image has two bits for each axis: 2 plus the shift of the image,
/// minus the cells by which the reduced sphere is displaced. Hence the shift of an image relative
/// to the given sphere a is the difference of its code and that of a.
__device__ inline std::uint32_t shift_code(const ImageShift& shift, const ImageShift& cells) {
  std::uint32_t code = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    code |= static_cast<std::uint32_t>(2 + shift[k] - cells[k]) << 2 * k;
  }
  return code;
}
/// Whether the sphere and its images have shift codes.
__device__ inline bool has_shift_code(const ImageShift& cells) {
  bool result = true;
  for (std::size_t k = 0; k < 3; ++k) result = result && (cells[k] == 0 || cells[k] == 1);
  return result;
}
__device__ inline std::uint32_t shift_code_of(std::uint32_t id) {
  return id >> 1 & ((1u << kShiftBits) - 1);
}
/// The shift along an axis of the image with the code `of_image`.
__device__ inline std::int32_t shift_between(std::uint32_t of_sphere, std::uint32_t of_image,
                                             unsigned axis) {
  return static_cast<std::int32_t>(of_image >> 2 * axis & 3) -
         static_cast<std::int32_t>(of_sphere >> 2 * axis & 3);
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

/// Number k of CellPoint::cells, or that of detail::reduce() if they were too large.
__device__ inline std::int32_t unpacked(const CellPoint& point, const PeriodicCell& cell, int k) {
  constexpr std::int32_t kBias = 1 << (CellPoint::kBits - 1);
  if (point.cells == CellPoint::kFarCells) {
    Real x = point.centre[k];
    return detail::reduce(&x, cell.lengths[k]);
  }
  const auto bits =
      static_cast<std::uint32_t>(point.cells >> (CellPoint::kBits * static_cast<unsigned>(k)));
  return static_cast<std::int32_t>(bits & (2 * kBias - 1)) - kBias;
}

/// Loads a point through the read-only cache.
__device__ inline CellPoint load_point(const CellPoint* p) {
  static_assert(sizeof(CellPoint) == sizeof(SphereInstance));
  return std::bit_cast<CellPoint>(load_sphere(reinterpret_cast<const SphereInstance*>(p)));
}

/// The shift of spheres a < b that touch, but not twice, from their points.
__device__ inline ImageShift shift_of_points(const CellPoint& p, const CellPoint& q,
                                             const PeriodicCell& cell) {
  ImageShift result{};
#pragma unroll
  for (int k = 0; k < 3; ++k) {
    const auto axis = static_cast<std::size_t>(k);
    if (!cell.repeats[axis]) continue;
    const std::int32_t of_p = unpacked(p, cell, k), of_q = unpacked(q, cell, k);
    const Real length = cell.lengths[k], x = detail::displaced(p.centre[k], of_p, length),
               y = detail::displaced(q.centre[k], of_q, length);
    result[axis] = of_p - of_q + detail::nearest_shift(x - y, length);
  }
  return result;
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
    Real in_cell = x;
    shift += detail::reduce(&in_cell, length);
    in_cell = y;
    shift -= detail::reduce(&in_cell, length);
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
  if (!touches_at(known, reduced, a, b, image, -1)) return false;
  const Real sum = known.given[a].radius + known.given[b].radius;
#pragma unroll 1
  for (int k = 0; k < 3; ++k) {
    if (!known.cell.repeats[static_cast<std::size_t>(k)]) continue;
    if (!detail::may_touch_twice(sum, known.cell.lengths[k])) continue;
    if (touches_at(known, reduced, a, b, image, k)) return false;
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
