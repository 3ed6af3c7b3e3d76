/// Loops over lists of pairs or contacts, and searches in sorted ones.
#pragma once

#include <jfpx/config.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

inline constexpr unsigned kListThreads = 256;

/// Kernels whose number of elements is on the device loop over it with at most 4096 blocks.
inline unsigned list_blocks(std::size_t n) {
  constexpr std::size_t kMaxBlocks = 4096;
  return static_cast<unsigned>(std::clamp<std::size_t>(n / kListThreads + 1, 1, kMaxBlocks));
}

/// Index of this thread, and the distance to its next element.
__device__ inline std::size_t first_element() {
  return std::size_t{blockIdx.x} * kListThreads + threadIdx.x;
}
__device__ inline std::size_t element_stride() { return std::size_t{gridDim.x} * kListThreads; }

/// The number of items before (a, b) among the first n items, which are sorted by (a, b).
template <class Item>
__device__ std::size_t items_before(const Item* items, std::size_t n, std::uint64_t a,
                                    std::uint64_t b = 0) {
  std::size_t low = 0, high = n;
  while (low < high) {
    const std::size_t middle = low + (high - low) / 2;
    const std::uint32_t row = items[middle].a;
    if (row < a || (row == a && items[middle].b < b)) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
