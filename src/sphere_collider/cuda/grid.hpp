/// Search among many spheres, which are sorted into the cells of a hierarchy of grids.
///
/// There are four variants, which write the same contacts:
///  - direct (grid_direct.cuh): up to kMaxDirect spheres of similar radius, not sorted;
///  - in one cooperative launch (grid_one_launch.cu): up to kMaxInOneLaunch spheres; the same
///    kernel first tries the direct search;
///  - single-level (grid_single_level.cuh): more spheres, of similar radius, in several launches;
///    if they are crowded, a warp searches for several of them together (grid_crowded.cuh);
///  - multi-level (grid_search.cuh): more spheres, of any radii, in several launches.
///
/// In a periodic cell, images of spheres near its faces are further spheres without rows
/// (periodic_pairs.cuh). There, one launch is direct or single-level, and any number of spheres
/// that need several levels takes several launches.
///
/// The word row has two meanings. A row of cells consists of the cells of one level with the same y
/// and z. Row a of the output, or of GridArgs::Rows, consists of the contacts (a, b), a < b.
#pragma once

#include "src/sphere_collider/cuda/search.hpp"
#include "src/sphere_collider/cuda/tuning.hpp"

#include <cuda_runtime_api.h>

#include <cstddef>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Number of elements beyond the last sphere that a search reads and ignores.
inline constexpr std::uint32_t kReadBeyond = 2;

/// The pair a < b; `rank` counts the pairs of a in the order of discovery.
struct OverflowPair {
  std::uint32_t a, b, rank;
};

/// Double-buffered state of searches in one launch: each search clears the state of the next one.
struct AlternatingStates {
  SearchState states[2];
  std::uint32_t searches;  ///< number of searches so far; its parity selects the next state
  std::uint32_t padding[3];
};

/// Histogram of the coarse buckets, and the positions of their spheres.
struct CoarseBuckets {
  /// Padded to a memory sector: atomics on values in the same sector are serialized.
  struct alignas(32) Counter {
    std::uint32_t value;
  };
  Counter counts[kCoarseBuckets];
  Counter next[kCoarseBuckets];  ///< position of the next sphere
  std::uint32_t starts[kCoarseBuckets + 4];
};

/// Limits of a device that determine launch configurations and buffer sizes.
struct GridLimits {
  unsigned multiprocessors;
  unsigned resident_blocks;  ///< blocks of the search in one launch that can run at the same time
  std::size_t shared_bytes;  ///< largest amount of shared memory of a block
  /// Largest number of blocks that share the table and the spheres. It is not less than
  /// resident_blocks, because a multiprocessor runs at most 8 blocks of 256 threads at a time.
  constexpr unsigned max_blocks() const { return multiprocessors * 16; }
};
/// @pre `device` is the current device. @throws DeviceError
GridLimits grid_limits(int device);

/// Number of elements of GridArgs::Rows::sums in a search among n spheres: enough for one sum per
/// block or per kBinsOfSum bins. It is even, so that the array after it is 16-byte aligned.
constexpr std::size_t grid_sums(std::size_t n, const GridLimits& limits) {
  return limits.max_blocks() + n / (kBin * kBinsOfSum) / 2 * 2 + 2;
}

struct GridPlan;
/// sizeof(GridPlan), which only device code defines.
std::size_t grid_plan_bytes();

/// Arguments of a grid search. Arrays are 16-byte aligned and have 15 spare bytes at the end.
struct GridArgs {
  /// The spheres sorted by bucket. The position of a sphere is its index in that order.
  struct Table {
    std::uint32_t size;        ///< largest number of buckets: a power of two
    std::uint32_t* starts;     ///< [size + 1] histogram, then first positions, of the buckets
    std::uint32_t* positions;  ///< [n] first the bucket, then the position, of a sphere; on one
                               ///< level, only of long rows
    /// [n] first the rank in its bucket, then positions of rows_again, then the length of its row
    std::uint32_t* ranks;
    SphereInstance* sorted;    ///< [n + kReadBeyond] spheres by position
    std::uint32_t* ids;        ///< [n] their ids
    unsigned long long* sums;  ///< [blocks] spheres in the buckets of each block; direct: its pairs
    CoarseBuckets* coarse;
    std::uint32_t coarse_buckets = kCoarseBuckets;  ///< largest number of coarse buckets in use
  };
  /// Row a holds the pairs (a, b), a < b.
  struct Rows {
    std::uint32_t* counts;          ///< [n] row lengths by position
    unsigned long long* sums;       ///< [grid_sums(n)] pairs of each block, or of kBinsOfSum bins
    unsigned long long* bin_sums;   ///< [n / kBin + 1] pairs of the spheres of a bin
    unsigned long long* offsets;    ///< [n] StagedList; of a long row, then its index in the output
    unsigned long long capacity;    ///< largest number of pairs that the arrays can hold
    OverflowPair* overflow;         ///< [capacity] pairs for which a sphere has no slot
    std::uint32_t* long_rows;       ///< [capacity / kSlots + 1] a's with up to kMaxLongRow pairs
    std::uint32_t* very_long_rows;  ///< [capacity / kMaxLongRow + 1] a's with more pairs
    std::uint32_t* long_row_neighbors;  ///< [capacity] b's of both, by index in the output
  };
  /// Arrays that share memory, because they are used at different times: slots and slot_ids,
  /// partitioned and partitioned_ids, neighbors, staging.
  struct Scratch {
    SphereInstance* slots;           ///< [kDirectSlots * n] slots of cells; null if n > kMaxDirect
    std::uint32_t* slot_ids;         ///< [kDirectSlots * n] ids of the spheres there
    SphereInstance* partitioned;     ///< [n] spheres by coarse bucket
    std::uint32_t* partitioned_ids;  ///< [n] their ids
    std::uint32_t* neighbors;        ///< [n][kSlots] the first b's of a row, by position
    SphereContact* staging;          ///< [capacity] contacts, or neighbors, of short rows
  };
  SphereInput input;  ///< at least one sphere; packed, but for a search in one launch
  Table table;
  Rows rows;
  Scratch scratch;
  SearchState* state;
  AlternatingStates* states;  ///< for searches in one launch, instead of `state`
  GridPlan* plan;             ///< for searches of several launches
  std::uint32_t lanes = 1;    ///< threads per sphere in the search: a power of two
};

/// Number of bytes of the arrays of GridArgs::Scratch.
std::size_t grid_scratch_bytes(std::size_t n, std::size_t capacity);
/// The arrays of a search among n spheres, in `memory` of grid_scratch_bytes().
GridArgs::Scratch grid_scratch(std::uint32_t n, unsigned char* memory);

/// Whether a search among n spheres is one launch.
bool is_in_one_launch(std::size_t n);
/// Enqueues the whole search. Does not allocate or wait.
void launch_grid_search(const GridArgs& args, const SearchOutput& output, const GridLimits& limits,
                        cudaStream_t stream);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
