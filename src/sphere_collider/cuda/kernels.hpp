/// The kernels' launchers, for host code. All enqueue on a stream, check the launch, allocate
/// nothing and wait for nothing.
#pragma once

#include <jfpx/contact.hpp>
#include <jfpx/cuda/sphere_collider.hpp>

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Counters that kernels of one search share. Zero bytes at the start of a search.
struct alignas(16) SearchState {
  unsigned long long contacts;       ///< that the grid has found, crowded_contacts not included
  unsigned long long overflow;       ///< entries of GridArgs::overflow, also those without room
  unsigned long long largest_half;   ///< bits of the largest half cell that a radius asks for
  unsigned long long smallest_half;  ///< ~bits of the smallest one
  unsigned long long farthest[6];    ///< ordered bits of the largest x, -x, y, -y, z, -z
  std::uint32_t valid_before;        ///< ~(lowest index of an invalid sphere), 0 if there is none
  std::uint32_t levels;              ///< bit l: there are spheres on grid level l
  std::uint32_t crowded;             ///< entries of GridArgs::crowded
  std::uint32_t giants;              ///< entries of GridArgs::giants
  std::uint32_t has_far;             ///< 1: there are spheres far from the origin (grid_cells.hpp)
  std::uint32_t blocks_sampled;      ///< blocks that have done their part of the sample
  std::uint32_t blocks_counted;      ///< blocks that have counted coarse buckets
  std::uint32_t cell_is_full;        ///< 1: a cell of the direct search has no room
  std::uint32_t block_is_full;       ///< 1: a block of the direct search found too many pairs
  unsigned long long crowded_contacts;  ///< that have no place on the stage
  std::uint32_t same_cell[32];          ///< pairs of a sample in the same cell, by level
};

/// Where a search puts its result. `contacts` or `pairs` is null.
struct SearchOutput {
  SphereContact* contacts;
  SpherePair* pairs;
  unsigned long long capacity;
  ContactCount* count;
};

// --- scan --------------------------------------------------------------------------------------

/// Bytes of scratch memory that the scan of up to `n` values needs.
std::size_t scan_scratch_bytes(std::size_t n);
/// sums[i] becomes the sum of the values before i, in 64 bits.
void exclusive_scan(const std::uint32_t* values, unsigned long long* sums, std::size_t n,
                    void* scratch, std::size_t scratch_bytes, cudaStream_t stream);

// --- small N: one launch -----------------------------------------------------------------------

inline constexpr std::uint32_t kFusedSpheres = 1024;

struct FusedArgs {
  const SphereInstance* spheres;
  std::uint32_t n;  ///< at most kFusedSpheres
  SearchOutput output;
};
/// Whether the current device can run it: it needs clusters of 16 thread blocks, as Hopper has, and
/// code that was compiled for them.
bool fused_search_supported();
void launch_fused_search(const FusedArgs& args, cudaStream_t stream);

// --- all pairs ---------------------------------------------------------------------------------

/// Pairs are looked at in square tiles; their outcome is a bit matrix, one row a sphere.
inline constexpr std::uint32_t kTile = 256;
inline constexpr std::uint32_t kWordsPerTile = kTile / 32;

/// Words of a row of the bit matrix.
constexpr std::uint32_t mask_stride(std::uint32_t n) {
  return (n + kTile - 1) / kTile * kWordsPerTile;
}

struct AllPairsArgs {
  const SphereInstance* spheres;
  std::uint32_t n;
  std::uint32_t first_row, rows;  ///< the band of rows to do; first_row is a multiple of kTile
  std::uint32_t* masks;           ///< [rows rounded up to kTile][mask_stride(n)]
  std::uint32_t* counts;          ///< [n + 1] contacts per sphere a; zero at the start
  bool count;                     ///< add to `counts`
  SearchState* state;
};
void launch_all_pairs(const AllPairsArgs& args, cudaStream_t stream);

struct MaskEmitArgs {
  const SphereInstance* spheres;
  std::uint32_t n;
  std::uint32_t first_row, rows;
  const std::uint32_t* masks;
  const unsigned long long* offsets;  ///< [n + 1]
  const SearchState* state;
  SearchOutput output;
};
void launch_mask_emit(const MaskEmitArgs& args, cudaStream_t stream);

// --- large N: hashed grid ----------------------------------------------------------------------

/// Partners that a sphere keeps in its own slots; further ones go to a list for all spheres.
inline constexpr std::uint32_t kSlots = 16;
/// Contacts of a sphere that have a place on the stage; if there are more, none has.
inline constexpr std::uint32_t kStaged = 18;
/// Spheres that a search reads, and does not use, after the last one.
inline constexpr std::uint32_t kReadBeyond = 2;
/// Lists longer than this are sorted by many blocks.
inline constexpr std::uint32_t kLongList = 1024;

/// The pair a < b: number `rank` among the pairs of a, in the order of discovery.
struct OverflowPair {
  std::uint32_t a, b, rank;
};

/// A search in one launch leaves the state of the next one clear.
struct TurningStates {
  SearchState states[2];
  std::uint32_t turn;  ///< whose number is even or odd: the state of the next search
  std::uint32_t padding[3];
};

/// Spheres that are not sorted but put into cells: for so many, at most, ...
inline constexpr std::uint32_t kMaxDirect = 24'000;
/// ... cells have this much room for each of them.
inline constexpr std::uint32_t kDirectSlots = 12;

/// Coarse buckets of a search of many launches.
inline constexpr unsigned kCoarseBuckets = 2048;
struct CoarseBuckets {
  /// In a sector of its own: atomics on numbers that share one wait for each other.
  struct alignas(32) Counter {
    std::uint32_t value;
  };
  Counter counts[kCoarseBuckets];
  Counter next[kCoarseBuckets];  ///< place of the next sphere
  std::uint32_t starts[kCoarseBuckets + 4];
};

/// Blocks that share out the table and the spheres, at most.
inline constexpr unsigned kMaxGridBlocks = 132 * 16;
/// Contacts of one level are counted by so many consecutive a's, which a block copies, ...
inline constexpr std::uint32_t kBin = 256;
/// ... and summed by so many of these bins.
inline constexpr std::uint32_t kBinsOfSum = 64;
/// Sums that a search among n spheres has beside those of its bins.
constexpr std::size_t grid_sums(std::size_t n) {
  return kMaxGridBlocks + n / (kBin * kBinsOfSum) / 2 * 2 + 2;
}

struct GridPlan;
/// Its size.
std::size_t grid_plan_bytes();

/// Arrays are 16-byte aligned, with room for 15 bytes more than said.
struct GridArgs {
  const SphereInstance* spheres;
  std::uint32_t n;                 ///< at least 1
  std::uint32_t table_size;        ///< a power of two
  std::uint32_t* table;            ///< [table_size + 1] histogram, then starts, of the buckets
  std::uint32_t* places;           ///< [n] bucket, then position in their order, of a sphere
  std::uint32_t* ranks;            ///< [n] rank in the bucket, then pairs, of a sphere
  SphereInstance* sorted;          ///< [n + kReadBeyond] spheres by position
  std::uint32_t* ids;              ///< [n] their indices
  unsigned long long* table_sums;  ///< [blocks] spheres in the buckets of each block
  unsigned long long* count_sums;  ///< [grid_sums(n)] pairs of each block, or kBinsOfSum bins
  unsigned long long* bin_sums;    ///< [n / kBin + 1] pairs of the spheres of a bin
  std::uint32_t* counts;           ///< [n] pairs of which a sphere is the first, by position
  // In scratch memory, one after the other; null until use_grid_scratch().
  SphereInstance* slots = nullptr;    ///< [kDirectSlots * n] room in cells; null if n > kMaxDirect
  std::uint32_t* slot_ids = nullptr;  ///< [kDirectSlots * n] indices of the spheres there
  SphereInstance* parted = nullptr;   ///< [n] spheres by coarse bucket
  std::uint32_t* parted_ids = nullptr;  ///< [n] their indices
  std::uint32_t* partners = nullptr;  ///< [n][kSlots] the first b's found of a sphere, by position
  SphereContact* stage =
      nullptr;  ///< contacts, or pairs, of spheres with up to kStaged, by position

  CoarseBuckets* coarse;
  OverflowPair* overflow;       ///< [capacity] the other pairs
  unsigned long long capacity;  ///< most pairs that there is room for
  unsigned long long* offsets;  ///< [n] contacts before those of a, if a has more than kSlots;
                                ///< before, where the stage has those of a: StagedList
  std::uint32_t* crowded;       ///< [capacity / kSlots + 1] a's with more than kSlots pairs
  std::uint32_t* giants;        ///< [capacity / kLongList + 1] a's with more than kLongList
  std::uint32_t* crowded_b;     ///< [capacity] b's of both, by place in the output
  SearchState* state;
  TurningStates* states;  ///< for searches of one launch, instead of `state`
  GridPlan* plan;         ///< for searches of several launches
  std::uint32_t coarse_buckets = kCoarseBuckets;  ///< of these, how many there may be
  std::uint32_t lanes = 1;  ///< threads that share a sphere in the search: a power of two
};

/// Bytes of memory in which arrays of one search follow those that it no longer needs.
std::size_t grid_scratch_bytes(std::size_t n, std::size_t capacity);
/// Sets the pointers into it.
void use_grid_scratch(GridArgs& args, unsigned char* scratch);

/// Blocks of the search that `device` holds at a time. It must be the current device.
unsigned most_grid_blocks(int device);
/// The whole search. `most_blocks` is the answer of most_grid_blocks().
void launch_grid_search(const GridArgs& args, const SearchOutput& output, unsigned most_blocks,
                        cudaStream_t stream);

// --- given pairs -------------------------------------------------------------------------------

void launch_test_pairs(const SphereInstance* spheres, const SpherePair* pairs, std::size_t m,
                       PairResult* results, cudaStream_t stream);

/// Pairs that a block counts, and then writes.
inline constexpr std::size_t kTouchingPerBlock = 2048;
constexpr std::size_t touching_blocks(std::size_t m) {
  return (m + kTouchingPerBlock - 1) / kTouchingPerBlock;
}

struct TouchingArgs {
  const SphereInstance* spheres;
  const SpherePair* pairs;
  std::size_t m;
  std::uint32_t* counts;     ///< [touching_blocks(m) + 1]; the last one becomes 0
  unsigned long long* sums;  ///< their exclusive scan
  PairContact* touching;     ///< [m], may be memory of the host
  unsigned long long* total;
};
void launch_count_touching(const TouchingArgs& args, cudaStream_t stream);
void launch_emit_touching(const TouchingArgs& args, cudaStream_t stream);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
