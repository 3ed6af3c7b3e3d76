/// Device functions shared by the phases of the grid search: the plan of the cell table, and
/// block-wide sums.
#pragma once

#include "src/sphere_collider/cuda/grid.hpp"
#include "src/sphere_collider/cuda/grid_cells.hpp"
#include "src/sphere_collider/cuda/local_filter.hpp"
#include "src/sphere_collider/cuda/periodic_pairs.cuh"
#include "src/sphere_collider/cuda/search.cuh"

#include <cub/block/block_scan.cuh>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

inline constexpr unsigned kGridWarps = kGridThreads / 32;

/// The half cell width of level 0. The state holds its bits, because the bits of positive
/// floating-point numbers are ordered like the numbers, so that atomicMax() applies.
__device__ inline Real half_0_of(const SearchState* state) {
  return std::bit_cast<Real>(static_cast<RealBits>(state->largest_half));
}
__device__ inline unsigned long long bits_of(Real x) {
  return static_cast<unsigned long long>(std::bit_cast<RealBits>(x));
}

/// Increasing map of Real to integers > 0, for atomicMax() on a value that is 0 initially.
__device__ inline unsigned long long ordered(Real x) {
  constexpr unsigned kShift = sizeof(Real) == 4 ? 32 : 0;
  const unsigned long long bits = static_cast<unsigned long long>(std::bit_cast<RealBits>(x))
                                  << kShift;
  constexpr unsigned long long kSign = 1ull << 63;
  return (bits & kSign) != 0 ? ~bits : bits | kSign;
}
/// Inverse of ordered().
__device__ inline Real from_ordered(unsigned long long key) {
  constexpr unsigned kShift = sizeof(Real) == 4 ? 32 : 0;
  constexpr unsigned long long kSign = 1ull << 63;
  const unsigned long long bits = (key & kSign) != 0 ? key & ~kSign : ~key;
  return std::bit_cast<Real>(static_cast<RealBits>(bits >> kShift));
}

/// Loads a sphere without the read-only cache, because an earlier phase of the same launch may have
/// written it.
__device__ inline SphereInstance load_sorted(const SphereInstance* p) {
  SphereInstance s;
  if constexpr (sizeof(Real) == 4) {
    const float4 v = *reinterpret_cast<const float4*>(p);
    s = {{v.x, v.y, v.z}, v.w};
  } else {
    const double2 lo = reinterpret_cast<const double2*>(p)[0];
    const double2 hi = reinterpret_cast<const double2*>(p)[1];
    s = {{static_cast<Real>(lo.x), static_cast<Real>(lo.y), static_cast<Real>(hi.x)},
         static_cast<Real>(hi.y)};
  }
  return s;
}

/// Bounds of the cells of one level that can contain spheres, and their first bucket.
struct LevelBox {
  std::int32_t x0, y0, z0;
  std::int32_t nx, ny, nz;
  std::uint32_t base;
};

/// First bucket of the row (y, z) of the level, minus the first x: cell x has bucket row + x.
__device__ inline std::uint32_t row_of_box(const LevelBox& box, std::int32_t y, std::int32_t z) {
  const auto yz = static_cast<std::uint32_t>((z - box.z0) * box.ny + (y - box.y0));
  return box.base + yz * static_cast<std::uint32_t>(box.nx) - static_cast<std::uint32_t>(box.x0);
}

/// Layout of the cell table. It is dense if no sphere is far and the cells of all levels between
/// the lowest and the highest coordinates fit into the table. In a dense table, each cell has its
/// own bucket, and rows are consecutive, so that cells that are close in y and z are close in
/// memory. Otherwise the first bucket of a row is hashed, and a bucket can hold spheres of several
/// cells.
struct GridPlan {
  GridScale scale;
  bool dense;
  bool single;  ///< dense, and all spheres are on level 0
  /// Whether a warp searches for several spheres together: `single`, with more than kCrowded
  /// spheres per cube of the cell width on average, and a cell width that local_filter.hpp
  /// supports.
  bool crowded;
  bool ordered;      ///< crowded, with more than kVeryCrowded spheres per cube: see order_cells()
  bool equal_radii;  ///< of all spheres
  Real inverse_yz;   ///< inverse cell width of level 0, in y and z
  std::uint32_t buckets;
  std::uint32_t coarse_shift;  ///< 2^coarse_shift consecutive buckets are a coarse bucket
  LevelBox boxes[kLastLevel + 1];

  /// Cell x of the row has bucket row + x, modulo `mask() + 1`.
  template <bool kDense>
  __device__ std::uint32_t row(std::int32_t y, std::int32_t z, int level) const {
    if constexpr (!kDense) return row_of(y, z, level);
    return row_of_box(boxes[level], y, z);
  }
  template <bool kDense>
  __device__ std::uint32_t mask() const {
    return kDense ? ~0u : buckets - 1;
  }
  template <bool kDense>
  __device__ std::uint32_t bucket(const GridCell& cell) const {
    return (row<kDense>(cell.y, cell.z, cell.level) + static_cast<std::uint32_t>(cell.x)) &
           mask<kDense>();
  }
  __device__ std::uint32_t bucket_of(const SphereInstance& s) const {
    if (single) {
      const LevelBox& box = boxes[0];
      const std::int32_t y = cell_of(s.centre.y, inverse_yz) - box.y0;
      const std::int32_t z = cell_of(s.centre.z, inverse_yz) - box.z0;
      const std::int32_t x = cell_of(s.centre.x, scale.inverse_x) - box.x0;
      return static_cast<std::uint32_t>((z * box.ny + y) * box.nx + x);
    }
    const GridCell cell = grid_cell_of(s, scale);
    return dense ? bucket<true>(cell) : bucket<false>(cell);
  }
};

/// The finest level in use: the first level on which a sphere shares its cell with at most about
/// two others, estimated from a sample of all spheres. All smaller spheres are also on this level.
/// Sharing a cell costs little, whereas each level requires one more search per smaller sphere.
__device__ inline int last_level(const SearchState& state, std::uint32_t n) {
  const auto smallest = static_cast<RealBits>(~state.smallest_half);
  const int finest = level_for(std::bit_cast<Real>(smallest), {half_0_of(&state)});
  const std::uint64_t samples = n < kSamples ? n : kSamples;
  for (int level = 0; level < finest; ++level) {
    if (state.same_cell[level] * std::uint64_t{n} <= samples * samples) return level;
  }
  return finest > 0 ? finest : 0;
}

/// Computes the plan of a search, which is equal in all blocks. Call from all threads of the block.
__device__ inline void make_plan(const GridArgs& args, GridPlan& plan) {
  __syncthreads();
  if (threadIdx.x < 32) {
    const SearchState& state = *args.state;
    const int level = static_cast<int>(lane_id());
    GridScale scale{half_0_of(args.state), last_level(state, args.input.n)};
    Real x_cells = 2;  // cells in x per cell width of the last level
    // In a periodic cell, only pairs of equal spheres can be tested relative to a common origin.
    const bool equal_radii = state.largest_half == ~state.smallest_half;
    const bool may_be_crowded =
        scale.last_level == 0 && state.has_far == 0 && (equal_radii || !args.input.is_periodic()) &&
        scale.half_0 >= kLeastLocalHalf && scale.half_0 <= kLargestLocalHalf;
    Real per_cube = 0;  // spheres per cube of the cell width: the larger estimate
    const Vec3 high{from_ordered(state.farthest[0]), from_ordered(state.farthest[2]),
                    from_ordered(state.farthest[4])};
    const Vec3 low{-from_ordered(state.farthest[1]), -from_ordered(state.farthest[3]),
                   -from_ordered(state.farthest[5])};
    constexpr unsigned long long kTooMany = 1ull << 40;
    LevelBox box{};
    unsigned long long cells = 0, cells_to_here = 0, all_cells = 0;
    while (true) {
      scale.inverse_x = x_cells * inverse_width(half_cell_of(scale.half_0, scale.last_level));
      if (level <= scale.last_level) {
        const Real inverse = inverse_width(half_cell_of(scale.half_0, level));
        const auto extent = [&](Real from, Real to, Real inverse_cell, std::int32_t& first) {
          first = cell_of(from, inverse_cell);
          return std::int64_t{cell_of(to, inverse_cell)} - first + 1;
        };
        const std::int64_t nx = extent(low.x, high.x, scale.inverse_x, box.x0);
        const std::int64_t ny = extent(low.y, high.y, inverse, box.y0);
        const std::int64_t nz = extent(low.z, high.z, inverse, box.z0);
        box.nx = static_cast<std::int32_t>(nx);
        box.ny = static_cast<std::int32_t>(ny);
        box.nz = static_cast<std::int32_t>(nz);
        const auto rows = static_cast<unsigned long long>(ny * nz);
        const auto row = static_cast<unsigned long long>(nx);
        cells = rows < (1ull << 32) && row < (1ull << 31) ? min(rows * row, kTooMany) : kTooMany;
      }
      cells_to_here = warp_inclusive_sum(cells);
      all_cells = __shfl_sync(kFullWarp, cells_to_here, 31);
      per_cube =
          max(per_cube, x_cells * static_cast<Real>(args.input.n) / static_cast<Real>(all_cells));
      const bool fits = all_cells <= args.table.size,
                 is_ordered = fits && may_be_crowded && per_cube > kVeryCrowded;
      if ((fits && !is_ordered) || x_cells == 1) break;
      x_cells = 1;
      cells = 0;
    }
    box.base = static_cast<std::uint32_t>(cells_to_here - cells);
    plan.boxes[level] = box;
    if (level == 0) {
      const bool dense = all_cells <= args.table.size && state.has_far == 0;
      if (!dense) scale.inverse_x = 0;
      plan.scale = scale;
      plan.dense = dense;
      plan.single = dense && scale.last_level == 0;
      plan.equal_radii = equal_radii;
      plan.crowded = plan.single && may_be_crowded && per_cube > kCrowded;
      plan.ordered = plan.crowded && per_cube > kVeryCrowded;
      plan.inverse_yz = inverse_width(half_cell_of(scale.half_0, 0));
      plan.buckets = dense ? static_cast<std::uint32_t>(all_cells) : args.table.size;
      plan.coarse_shift = 0;
      while ((plan.buckets - 1) >> plan.coarse_shift >= args.table.coarse_buckets)
        ++plan.coarse_shift;
    }
  }
  __syncthreads();
}

/// Copies the plan of plan_phase(). Call from all threads of the block.
__device__ inline void copy_plan(const GridArgs& args, GridPlan& plan) {
  static_assert(sizeof(GridPlan) % sizeof(std::uint32_t) == 0);
  const auto* const from = reinterpret_cast<const std::uint32_t*>(args.plan);
  auto* const to = reinterpret_cast<std::uint32_t*>(&plan);
  for (unsigned k = threadIdx.x; k < sizeof(GridPlan) / sizeof(std::uint32_t); k += kGridThreads) {
    to[k] = from[k];
  }
  __syncthreads();
}

/// Range of items [first, past).
struct Span {
  std::uint64_t first, past;
};
/// The items of this block, if `count` items are divided evenly. `first` is a multiple of `unit`.
__device__ inline Span span_of_block(std::uint64_t count, unsigned unit) {
  const std::uint64_t units = (count + unit - 1) / unit;
  const std::uint64_t first = units * blockIdx.x / gridDim.x * unit;
  const std::uint64_t past = units * (blockIdx.x + 1) / gridDim.x * unit;
  return {first, past < count ? past : count};
}

/// Block-wide sums. Threads must synchronize before they reuse a TempStorage.
using BlockSums = cub::BlockScan<unsigned long long, kGridThreads, cub::BLOCK_SCAN_WARP_SCANS>;

/// Sum of `value` over the lower threads of the block; `total` becomes the sum over all threads.
__device__ inline unsigned long long block_exclusive_sum(unsigned long long value,
                                                         BlockSums::TempStorage& storage,
                                                         unsigned long long& total) {
  unsigned long long before = 0;
  BlockSums(storage).ExclusiveSum(value, before, total);
  return before;
}

/// Sum over the threads of the block, returned in every thread. (cub::BlockReduce returns it in one
/// thread.)
__device__ inline unsigned long long block_sum(unsigned long long value,
                                               BlockSums::TempStorage& storage) {
  __syncthreads();
  unsigned long long total = 0;
  block_exclusive_sum(value, storage, total);
  __syncthreads();
  return total;
}

/// Sum of the entries of `sums` of all lower blocks. Call from all threads of the block.
__device__ inline unsigned long long sum_of_blocks_before(const unsigned long long* sums,
                                                          BlockSums::TempStorage& storage) {
  unsigned long long mine = 0;
  for (unsigned k = threadIdx.x; k < blockIdx.x; k += kGridThreads) mine += sums[k];
  return block_sum(mine, storage);
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
