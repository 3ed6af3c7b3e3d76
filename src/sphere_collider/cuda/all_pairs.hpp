/// Search of all pairs: a bit matrix of touching pairs, then contacts in canonical order.
#pragma once

#include "src/sphere_collider/cuda/search.hpp"
#include "src/sphere_collider/cuda/tuning.hpp"

#include <cuda_runtime_api.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

inline constexpr std::uint32_t kWordsPerTile = kTile / 32;

/// Words of a row of the bit matrix, which has a row per sphere.
constexpr std::uint32_t mask_stride(std::uint32_t n) {
  return (n + kTile - 1) / kTile * kWordsPerTile;
}

struct AllPairsArgs {
  const SphereInstance* spheres;
  std::uint32_t n;
  std::uint32_t first_row, rows;  ///< the band of rows to test; first_row is a multiple of kTile
  std::uint32_t* masks;           ///< [rows rounded up to kTile][mask_stride(n)]
  std::uint32_t* counts;          ///< [n + 1] row lengths, and a 0; must be 0 initially
  bool count;                     ///< whether to add to `counts`
  SearchState* state;
};
/// Enqueues the test of a band of rows. Does not allocate or wait.
void launch_all_pairs(const AllPairsArgs& args, cudaStream_t stream);

struct MaskEmitArgs {
  const SphereInstance* spheres;
  std::uint32_t n;
  std::uint32_t first_row, rows;
  const std::uint32_t* masks;
  const unsigned long long* offsets;  ///< [n + 1] exclusive scan of AllPairsArgs::counts
  const SearchState* state;
  SearchOutput output;
};
/// Enqueues the output of the contacts of a band of rows. Does not allocate or wait.
void launch_mask_emit(const MaskEmitArgs& args, cudaStream_t stream);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
