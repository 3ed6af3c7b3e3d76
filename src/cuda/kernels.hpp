/// The kernels' launchers, for host code. All enqueue on a stream, check the launch, allocate
/// nothing and wait for nothing.
#pragma once

#include <jfpx/contact.hpp>
#include <jfpx/cuda/sphere_collider.hpp>

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>

namespace jfpx::inline JFPX_ABI::cuda {

/// Counters that kernels of one search share. Zero bytes at the start of a search.
struct SearchState {
  unsigned long long overflow;      ///< entries of GridArgs::overflow, also those that did not fit
  unsigned long long largest_half;  ///< bits of the largest half cell that a radius asks for
  std::uint32_t valid_before;       ///< ~(lowest index of an invalid sphere), 0 if there is none
  std::uint32_t levels;             ///< bit l: there are spheres on grid level l
  std::uint32_t crowded;            ///< entries of GridArgs::crowded
  std::uint32_t giants;             ///< entries of GridArgs::giants
};

/// Where a search puts its result. `contacts` or `pairs` is null.
struct SearchOutput {
  SphereContact* contacts;
  SpherePair* pairs;
  unsigned long long capacity;
  ContactCount* count;
};

/// cudaSuccess if this build has machine code, or code to be compiled, for the current device.
cudaError_t kernels_loadable();

// --- scans -------------------------------------------------------------------------------------

/// Bytes of scratch memory that the scans of up to `n` values need.
std::size_t scan_scratch_bytes(std::size_t n);
/// values[i] becomes the sum of the values before i.
void exclusive_scan(std::uint32_t* values, std::size_t n, void* scratch, std::size_t scratch_bytes,
                    cudaStream_t stream);
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
/// Whether the current device can run it: it needs clusters of 16 thread blocks, as Hopper has.
bool fused_search_supported(int compute_capability_major);
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
/// Lists longer than this are sorted by many blocks.
inline constexpr std::uint32_t kLongList = 1024;

/// The pair a < b: number `rank` among the pairs of a, in the order of discovery.
struct OverflowPair {
  std::uint32_t a, b, rank;
};

struct GridArgs {
  const SphereInstance* spheres;
  std::uint32_t n;
  std::uint32_t table_size;     ///< a power of two
  std::uint32_t* table;         ///< [table_size + 1] histogram, then starts, of the buckets
  uint2* places;                ///< [n] bucket of a sphere, its rank in there
  SphereInstance* sorted;       ///< [n] spheres in the order of the table
  std::uint32_t* ids;           ///< [n] their indices
  std::uint32_t* counts;        ///< [n + 1] pairs of which sphere a is the first
  std::uint32_t* partners;      ///< [kSlots][n] the first b's of a
  OverflowPair* overflow;       ///< [capacity] the other pairs
  unsigned long long capacity;  ///< most pairs that there is room for
  unsigned long long* offsets;  ///< [n + 1] exclusive scan of the counts
  std::uint32_t* crowded;       ///< [capacity / kSlots + 1] a's with more than kSlots pairs
  std::uint32_t* giants;        ///< [capacity / kLongList + 1] a's with more than kLongList pairs
  std::uint32_t* crowded_b;     ///< [capacity] b's of both, by place in the output
  SearchState* state;
};
/// Validates, finds the widest cell, clears table and counts.
void launch_grid_measure(const GridArgs& args, cudaStream_t stream);
/// Puts spheres into buckets: fills places and the histogram.
void launch_grid_assign(const GridArgs& args, cudaStream_t stream);
/// Sorts spheres by bucket, once the table has been scanned.
void launch_grid_scatter(const GridArgs& args, cudaStream_t stream);
/// Finds all touching pairs: fills counts, partners and overflow.
void launch_grid_search(const GridArgs& args, cudaStream_t stream);
/// Writes contacts or pairs in order, once the counts have been scanned, and the count.
void launch_grid_emit(const GridArgs& args, const SearchOutput& output, cudaStream_t stream);

// --- given pairs -------------------------------------------------------------------------------

void launch_test_pairs(const SphereInstance* spheres, const SpherePair* pairs, std::size_t m,
                       PairResult* results, cudaStream_t stream);

}  // namespace jfpx::inline JFPX_ABI::cuda
