/// The inner loops of neighbor lists: one table of functions per instruction set.
#pragma once

// Only macros, types and declarations may be included here (kernels.hpp has the reason).
#include <jfpx/config.hpp>

#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

/// This many elements after the end of a column are readable, and after the end of a result
/// writable.
inline constexpr std::uint32_t kNeighborLanes = 8;

/// Points, in double in both precisions.
struct NeighborColumns {
  const double* x;
  const double* y;
  const double* z;
  const std::uint32_t* index;
};

/// A point whose neighbors are searched.
struct NeighborQuery {
  double x, y, z;
  std::uint32_t least_index;  ///< points with smaller ones are left out
  double lowest, outer;       ///< points with other squares of distances are no neighbors
  double least, inner;        ///< points with squares in between are neighbors
};

struct NeighborKernels {
  /// Writes the indices of the points at positions `begin` to `end` - 1 whose squares are in
  /// [lowest, outer].
  /// @param unsure set if another test must decide one of them
  /// @return their number
  std::uint32_t (*search)(const NeighborColumns& columns, const NeighborQuery& query,
                          std::uint32_t begin, std::uint32_t end, std::uint32_t* found,
                          bool* unsure);
  /// Writes the rank of each of `count` different numbers, in O(count^2) time without branches.
  void (*rank)(const std::uint32_t* numbers, std::uint32_t count, std::uint32_t* ranks);
};

extern const NeighborKernels kBaselineNeighborKernels;
extern const NeighborKernels kAvx2NeighborKernels;

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
