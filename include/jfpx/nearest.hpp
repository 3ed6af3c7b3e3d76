/// The k nearest points of each point, or of other points.
#pragma once

#include <jfpx/periodic.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// The nearest points of M queries: row i, from element i * k to (i + 1) * k - 1 of each array, has
/// those of query i by ascending distance, then by ascending index.
struct NearestPoints {
  std::size_t k = 0;
  std::vector<std::uint32_t> indices;  ///< M * k
  std::vector<Real> distances;         ///< M * k, [m]
  /// M * k: the image of the point is at point + shift * lengths. Empty without a cell.
  std::vector<ImageShift> shifts;
};

struct NearestOptions {
  /// The nearest image of each point counts; of two images, half a length apart from the query
  /// after rounding to double, the one with the smaller shift.
  std::optional<PeriodicCell> cell = {};
  unsigned threads = 1;  ///< at most 256; 0: one per core. Has no effect on the result
};

/// Finds the `k` nearest other points of each point, on the CPU. Squares of distances are computed
/// in double in both precisions, and compared without a rounding to Real; points at equal distances
/// are listed by index. A k-d tree (Bentley 1975) is built and searched in O(N (log N + k log k))
/// time for usual points. May be called concurrently.
/// @param points [m], finite; coordinates up to 9e37 in float and 1e150 in double. Points may
///   coincide; in double, points closer than 1e-162 do.
/// @param k less than the number of points, or 0
/// @throws InvalidArgument for a coordinate or an option out of its range, more than 2^32 - 1
///   points, or a `k` that exceeds the number of other points; with a cell, for a length that is
///   not > 0 or exceeds 2^60 in float or 2^508 in double, and for a coordinate that is 2^20 lengths
///   or more from the origin. std::bad_alloc
JFPX_API NearestPoints find_nearest(std::span<const Vec3> points, std::size_t k,
                                    const NearestOptions& options = {});

/// Finds the `k` nearest points of each query. A point at the position of a query counts.
/// @param queries [m], as `points`
/// @param k at most the number of points
/// @throws the exceptions of the other overload
JFPX_API NearestPoints find_nearest(std::span<const Vec3> points, std::span<const Vec3> queries,
                                    std::size_t k, const NearestOptions& options = {});

}  // namespace JFPX_ABI
}  // namespace jfpx
