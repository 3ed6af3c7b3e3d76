/// Search within each of many independent systems: all pairs of each system.
#pragma once

#include "src/sphere_collider/cuda/search.hpp"

#include <cuda_runtime_api.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Arrays in device memory.
struct SystemsArgs {
  const SphereInstance* spheres;
  std::uint32_t n;
  const std::uint64_t*
      offsets;  ///< [systems + 1]: system i has spheres offsets[i] to offsets[i + 1]
  std::uint32_t systems;
  const PeriodicCell* cells;       ///< [systems], or null: systems are not periodic
  std::uint32_t* counts;           ///< [n + 1] row lengths, and a 0
  const unsigned long long* sums;  ///< [n + 1] exclusive scan of `counts`
  SearchState* state;              ///< zero at the start of a search
};
/// The index of the system of sphere `i`. Systems may be empty.
JFPX_HD inline std::uint32_t system_of(const std::uint64_t* offsets, std::uint32_t systems,
                                       std::uint32_t i) {
  std::uint32_t low = 0, high = systems - 1;
  while (low < high) {
    const std::uint32_t middle = low + (high - low) / 2;
    if (offsets[middle + 1] <= i) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}

/// Enqueues the count of the contacts of each sphere with later ones.
void launch_count_in_systems(const SystemsArgs& args, cudaStream_t stream);
/// Enqueues the output of the contacts, sorted by (a, b).
void launch_emit_in_systems(const SystemsArgs& args, const SearchOutput& output,
                            cudaStream_t stream);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
