/// The threads of a cooperative launch, which run the program of a device step together.
#pragma once

#include "src/world/device/step_data.hpp"

#include <cooperative_groups.h>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Loops over items, each with a barrier of all threads at its end. All threads must call the same
/// functions with the same numbers of items. Items of scan() and partition() belong to consecutive
/// chunks, one for each block.
class GridTeam {
 public:
  static constexpr unsigned kThreads = 256;

  /// Words of scratch memory for a launch with this number of blocks.
  static std::size_t scratch_words(unsigned blocks) {
    return std::size_t{blocks} * (1 + device::kBins);
  }

  /// @param scratch device memory of scratch_words()
  /// @param is_cluster whether all blocks are one cluster, whose barrier is faster
  JFPX_HD GridTeam(std::uint32_t* scratch, bool is_cluster)
      : block_sums_(scratch), is_cluster_(is_cluster) {
#if defined(__CUDA_ARCH__)
    block_bins_ = scratch + gridDim.x;
#endif
  }

  /// The items of this thread are first(), first() + stride(), ...; the caller synchronizes.
  JFPX_HD std::uint32_t first() const {
#if defined(__CUDA_ARCH__)
    return blockIdx.x * kThreads + threadIdx.x;
#else
    return 0;
#endif
  }
  JFPX_HD std::uint32_t stride() const {
#if defined(__CUDA_ARCH__)
    return gridDim.x * kThreads;
#else
    return 1;
#endif
  }
  /// Barrier of all threads. Writes before it are visible to all threads after it.
  JFPX_HD void sync() const {
#if defined(__CUDA_ARCH__)
    if (gridDim.x == 1) {
      __syncthreads();
      return;
    }
#if __CUDA_ARCH__ >= 900
    if (is_cluster_) {
      __threadfence();  // the blocks have different first-level caches
      cooperative_groups::this_cluster().sync();
      return;
    }
#endif
    cooperative_groups::this_grid().sync();
#endif
  }
  /// A copy of an array of device::kBins + 1 numbers in fast memory. At most one exists at a time.
  JFPX_HD const std::uint32_t* cached_bins(const std::uint32_t* numbers) const {
#if defined(__CUDA_ARCH__)
    __shared__ std::uint32_t copy[device::kBins + 1];
    for (std::uint32_t i = threadIdx.x; i <= device::kBins; i += kThreads) copy[i] = numbers[i];
    __syncthreads();
    return copy;
#else
    return numbers;
#endif
  }

  /// Calls f(i) for all i < n, in any order.
  template <class F>
  JFPX_HD void for_each(std::uint32_t n, const F& f) const {
#if defined(__CUDA_ARCH__)
    for (std::uint32_t i = blockIdx.x * kThreads + threadIdx.x; i < n; i += gridDim.x * kThreads) {
      f(i);
    }
    sync();
#endif
  }

  /// Calls f in one thread.
  template <class F>
  JFPX_HD void once(const F& f) const {
#if defined(__CUDA_ARCH__)
    if (blockIdx.x == 0 && threadIdx.x == 0) f();
    sync();
#endif
  }

  /// Number of i < n for which condition(i) holds.
  template <class Condition>
  JFPX_HD std::uint32_t count(std::uint32_t n, const Condition& condition) const {
#if defined(__CUDA_ARCH__)
    std::uint32_t mine = 0;
    for (std::uint32_t i = blockIdx.x * kThreads + threadIdx.x; i < n; i += gridDim.x * kThreads) {
      if (condition(i)) ++mine;
    }
    publish(block_sum(mine));
    const std::uint32_t total = sum_of_blocks(gridDim.x);
    sync();
    return total;
#else
    return 0;
#endif
  }

  /// Calls place(i, size(0) + ... + size(i - 1)) for all i < n. Calls size(i) twice; `place` must
  /// not change it. @returns the sum of all sizes
  template <class Size, class Place>
  JFPX_HD std::uint32_t scan(std::uint32_t n, const Size& size, const Place& place) const {
#if defined(__CUDA_ARCH__)
    const device::Range chunk = chunk_of(n);
    std::uint32_t mine = 0;
    for (std::uint32_t i = chunk.begin + threadIdx.x; i < chunk.end; i += kThreads) mine += size(i);
    publish(block_sum(mine));
    const std::uint32_t total = sum_of_blocks(gridDim.x);
    std::uint32_t before = sum_of_blocks(blockIdx.x);
    for (std::uint32_t tile = chunk.begin; tile < chunk.end; tile += kThreads) {
      const std::uint32_t i = tile + threadIdx.x;
      const std::uint32_t value = i < chunk.end ? size(i) : 0;
      std::uint32_t sum = 0;
      const std::uint32_t first = before + block_scan(value, &sum);
      if (i < chunk.end) place(i, first);
      before += sum;
    }
    sync();
    return total;
#else
    return 0;
#endif
  }

  /// Calls place(i, position) for all i < n with bin_of(i) != device::kNone: positions are
  /// consecutive, and those of a bin follow those of the bins before, in any order within the bin.
  /// @param begin receives the first position of each bin, and the number of all
  template <class BinOf, class Place>
  JFPX_HD void partition(std::uint32_t n, std::uint32_t bins, std::uint32_t* begin,
                         const BinOf& bin_of, const Place& place) const {
#if defined(__CUDA_ARCH__)
    __shared__ std::uint32_t next[device::kBins];
    __shared__ std::uint32_t totals[device::kBins];
    const device::Range chunk = chunk_of(n);
    for (std::uint32_t b = threadIdx.x; b < bins; b += kThreads) next[b] = 0;
    __syncthreads();
    for (std::uint32_t i = chunk.begin + threadIdx.x; i < chunk.end; i += kThreads) {
      const std::uint32_t bin = bin_of(i);
      if (bin != device::kNone) atomicAdd(&next[bin], 1u);
    }
    __syncthreads();
    for (std::uint32_t b = threadIdx.x; b < bins; b += kThreads) {
      block_bins_[blockIdx.x * bins + b] = next[b];
    }
    sync();
    for (std::uint32_t b = threadIdx.x; b < bins; b += kThreads) {
      std::uint32_t total = 0, before = 0;
      for (std::uint32_t block = 0; block < gridDim.x; ++block) {
        if (block == blockIdx.x) before = total;
        total += block_bins_[block * bins + b];
      }
      next[b] = before;
      totals[b] = total;
    }
    __syncthreads();
    if (threadIdx.x == 0) {
      std::uint32_t first = 0;
      for (std::uint32_t b = 0; b < bins; ++b) {
        if (blockIdx.x == 0) begin[b] = first;
        next[b] += first;
        first += totals[b];
      }
      if (blockIdx.x == 0) begin[bins] = first;
    }
    __syncthreads();
    for (std::uint32_t i = chunk.begin + threadIdx.x; i < chunk.end; i += kThreads) {
      const std::uint32_t bin = bin_of(i);
      if (bin != device::kNone) place(i, atomicAdd(&next[bin], 1u));
    }
    sync();
#endif
  }

 private:
#if defined(__CUDA_ARCH__)
  /// The items of this block.
  __device__ static device::Range chunk_of(std::uint32_t n) {
    const std::uint32_t tiles = (n + kThreads - 1) / kThreads;
    const std::uint32_t size = (tiles + gridDim.x - 1) / gridDim.x * kThreads;
    const std::uint64_t begin = std::uint64_t{blockIdx.x} * size;
    return {static_cast<std::uint32_t>(begin < n ? begin : n),
            static_cast<std::uint32_t>(begin + size < n ? begin + size : n)};
  }

  /// Sum of `value` before this thread in the block. @param sum receives that of all threads
  __device__ static std::uint32_t block_scan(std::uint32_t value, std::uint32_t* sum) {
    __shared__ std::uint32_t warp_sums[kThreads / 32];
    const unsigned lane = threadIdx.x % 32, warp = threadIdx.x / 32;
    std::uint32_t inclusive = value;
    for (unsigned offset = 1; offset < 32; offset *= 2) {
      const std::uint32_t other = __shfl_up_sync(0xffffffffu, inclusive, offset);
      if (lane >= offset) inclusive += other;
    }
    if (lane == 31) warp_sums[warp] = inclusive;
    __syncthreads();
    std::uint32_t before = 0, total = 0;
    for (unsigned w = 0; w < kThreads / 32; ++w) {
      if (w == warp) before = total;
      total += warp_sums[w];
    }
    __syncthreads();
    *sum = total;
    return before + inclusive - value;
  }
  __device__ static std::uint32_t block_sum(std::uint32_t value) {
    std::uint32_t sum = 0;
    block_scan(value, &sum);
    return sum;
  }

  /// Makes the sum of this block visible to all.
  __device__ void publish(std::uint32_t sum) const {
    if (threadIdx.x == 0) block_sums_[blockIdx.x] = sum;
    sync();
  }
  /// Sum of the published sums of the first blocks.
  __device__ std::uint32_t sum_of_blocks(std::uint32_t blocks) const {
    std::uint32_t mine = 0;
    for (std::uint32_t b = threadIdx.x; b < blocks; b += kThreads) mine += block_sums_[b];
    return block_sum(mine);
  }
#endif

  std::uint32_t* block_sums_;
  std::uint32_t* block_bins_ = nullptr;  ///< by block and bin
  bool is_cluster_;
};

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
