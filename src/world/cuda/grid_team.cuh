/// The threads of a cooperative launch that run the program of a device step.
#pragma once

#include "src/base/cuda/warp.cuh"
#include "src/world/device/step_data.hpp"

#include <cooperative_groups.h>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Shared memory of a block, with the alignment of four numbers.
struct alignas(4 * sizeof(Real)) SharedPiece {
  Real numbers[4];
};

/// Loops over items. All threads must call the same functions with the same item counts. scan() and
/// partition() assign consecutive chunks of items to the blocks.
class GridTeam {
 public:
  static constexpr unsigned kThreads = device::tuning::kThreads;

  /// Words of scratch memory for a launch with this number of blocks.
  static std::size_t scratch_words(unsigned blocks) {
    return std::size_t{blocks} * (2 + std::max<std::size_t>(device::kBins, kDigits));
  }

  /// @param scratch device memory of scratch_words()
  /// @param is_cluster whether all blocks are one cluster, whose barrier is faster
  JFPX_HD GridTeam(std::uint32_t* scratch, bool is_cluster)
      : block_sums_(reinterpret_cast<std::uint64_t*>(scratch)), is_cluster_(is_cluster) {
#if defined(__CUDA_ARCH__)
    blocks_ = gridDim.x;
    block_ = blockIdx.x;
    block_bins_ = scratch + 2 * gridDim.x;
#endif
  }

  /// Barrier of all threads. Writes before it are visible to all threads after it.
  JFPX_HD void sync() const {
#if defined(__CUDA_ARCH__)
    if (blocks_ == 1) {
      __syncthreads();
      return;
    }
#if __CUDA_ARCH__ >= 900
    if (is_cluster_) {
      __threadfence();  // first-level caches of the blocks are not coherent
      cooperative_groups::this_cluster().sync();
      return;
    }
#endif
    cooperative_groups::this_grid().sync();
#endif
  }
  /// Copies an array of device::kBins + 1 numbers to shared memory. At most one copy exists at a
  /// time.
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

  /// The threads of a block.
  class Threads {
   public:
    JFPX_HD void sync() const {
#if defined(__CUDA_ARCH__)
      __syncthreads();
#endif
    }
    /// Memory that the threads share: at most Program::kSharedBytes.
    JFPX_HD void* shared(std::size_t) const {
#if defined(__CUDA_ARCH__)
      extern __shared__ SharedPiece shared_memory[];
      return shared_memory;
#else
      return nullptr;
#endif
    }
    /// Calls f(i) for all i < n, in any order, without a barrier.
    template <class F>
    JFPX_HD void for_each(std::uint32_t n, const F& f) const {
#if defined(__CUDA_ARCH__)
      for (std::uint32_t i = threadIdx.x; i < n; i += kThreads) f(i);
#endif
    }
    /// Calls f in one thread, without a barrier.
    template <class F>
    JFPX_HD void once(const F& f) const {
#if defined(__CUDA_ARCH__)
      if (threadIdx.x == 0) f();
#endif
    }
    /// Calls f(thread, number of threads, sync) in each thread; all must call sync() equally often.
    template <class F>
    [[gnu::always_inline]] JFPX_HD void for_each_thread(const F& f) const {
#if defined(__CUDA_ARCH__)
      f(threadIdx.x, kThreads, [] { __syncthreads(); });
#endif
    }
  };

  /// Calls f(block, threads) for all blocks < n of a partition of work, in ascending order, each
  /// with the threads of one block of the launch. All calls with the same n assign a block to the
  /// same threads. The threads of a block wait for each other, but not for other blocks.
  template <class F>
  [[gnu::always_inline]] JFPX_HD void for_blocks(std::uint32_t n, const F& f) const {
#if defined(__CUDA_ARCH__)
    for (std::uint32_t block = block_; block < n; block += blocks_) {
      f(block, Threads());
      __syncthreads();
    }
#endif
  }

  /// Calls f(i) for all i < n, in any order, without a barrier.
  template <class F>
  JFPX_HD void for_each_nowait(std::uint32_t n, const F& f) const {
#if defined(__CUDA_ARCH__)
    for (std::uint32_t i = first(); i < n; i += blocks_ * kThreads) f(i);
#endif
  }
  /// Calls f(i) for all i < n, in any order, then waits for all threads.
  template <class F>
  JFPX_HD void for_each(std::uint32_t n, const F& f) const {
    for_each_nowait(n, f);
    sync();
  }
  /// Calls f(thread, number of threads, sync) in each thread; all must call sync() equally often.
  template <class F>
  [[gnu::always_inline]] JFPX_HD void for_each_thread(const F& f) const {
#if defined(__CUDA_ARCH__)
    f(first(), blocks_ * kThreads, [&] { sync(); });
#endif
  }
  /// Calls f in one thread, without a barrier.
  template <class F>
  JFPX_HD void once(const F& f) const {
#if defined(__CUDA_ARCH__)
    if (first() == 0) f();
#endif
  }
  /// Calls f(team) with the threads of one block as a team, whose barriers are faster. No barrier
  /// follows.
  template <class F>
  JFPX_HD void in_one_block(const F& f) const {
#if defined(__CUDA_ARCH__)
    if (block_ != 0) return;
    GridTeam team = *this;
    team.blocks_ = 1;
    f(team);
#endif
  }

  /// Dataflow without a barrier: for all i < n, starts an item with begin(i, &item), waits until
  /// is_ready(item), and calls complete(item). An item may wait for items of lower warps (32 items
  /// each) and of earlier calls. All calls with the same n assign item i to the same thread; once()
  /// always uses the same thread.
  template <class Dataflow>
  [[gnu::always_inline]] JFPX_HD void run_dataflow(std::uint32_t n,
                                                   const Dataflow& dataflow) const {
#if defined(__CUDA_ARCH__)
    // Consecutive warps are in different blocks, so that a few items use several multiprocessors.
    constexpr std::uint32_t kLanes = 32;
    const std::uint32_t warp = threadIdx.x / kLanes * blocks_ + block_;
    const std::uint32_t start = warp * kLanes + lane_id();
    for (std::uint32_t i = start; i - lane_id() < n; i += blocks_ * kThreads) {
      typename Dataflow::Item item;
      if (i < n) dataflow.begin(i, &item);
      // All lanes wait together: one after the other, they would take 32 times as long.
      bool waits = i < n;
      while (__any_sync(kFullWarp, waits)) {
        if (waits) waits = !dataflow.is_ready(&item);
      }
      if (i < n) dataflow.complete(&item);
    }
#endif
  }

  /// Adds the number of i < n for which condition(i) holds, without a barrier.
  template <class Condition>
  JFPX_HD void count(std::uint32_t n, const Condition& condition, std::uint32_t* sum) const {
#if defined(__CUDA_ARCH__)
    std::uint32_t mine = 0;
    for (std::uint32_t i = first(); i < n; i += blocks_ * kThreads) {
      if (condition(i)) ++mine;
    }
    mine = warp_sum(mine);
    if (lane_id() == 0 && mine > 0) atomicAdd(sum, mine);
#endif
  }

  /// Calls place(i, size(0) + ... + size(i - 1)) for all i < n. The size of an item is measure(i)
  /// in the first pass, called once, and size(i) in later passes. @returns the sum of all sizes
  template <class Measure, class Size, class Place>
  JFPX_HD auto scan(std::uint32_t n, const Measure& measure, const Size& size,
                    const Place& place) const -> decltype(size(0)) {
    using Number = decltype(size(0));
#if defined(__CUDA_ARCH__)
    const device::Range chunk = chunk_of(n);
    Number mine = 0;
    for (std::uint32_t i = chunk.begin + threadIdx.x; i < chunk.end; i += kThreads) {
      mine += measure(i);
    }
    const Number block_total = block_sum(mine);
    if (threadIdx.x == 0) block_sums_[block_] = block_total;
    sync();
    const Number total = sum_of_blocks<Number>(blocks_);
    Number before = sum_of_blocks<Number>(block_);
    for (std::uint32_t tile = chunk.begin; tile < chunk.end; tile += kThreads) {
      const std::uint32_t i = tile + threadIdx.x;
      const Number value = i < chunk.end ? size(i) : 0;
      Number sum = 0;
      const Number first = before + block_scan(value, &sum);
      if (i < chunk.end) place(i, first);
      before += sum;
    }
    sync();
    return total;
#else
    return Number{0};
#endif
  }

  /// Calls place(i, position, bin) for all i < n with bin_of(i) < device::kBins. Positions are
  /// consecutive and ascend by bin; the order within a bin is arbitrary.
  /// @param bins  receives bin_of(i), which is called once
  /// @param begin receives the first position of each bin, then the total number
  template <class BinOf, class Place>
  JFPX_HD void partition(std::uint32_t n, std::uint16_t* bins, std::uint32_t* begin,
                         const BinOf& bin_of, const Place& place) const {
#if defined(__CUDA_ARCH__)
    constexpr std::uint32_t kBins = device::kBins;
    __shared__ std::uint32_t next[kBins];
    __shared__ std::uint32_t totals[kBins];
    const device::Range chunk = chunk_of(n);
    for (std::uint32_t b = threadIdx.x; b < kBins; b += kThreads) next[b] = 0;
    __syncthreads();
    for (std::uint32_t i = chunk.begin + threadIdx.x; i < chunk.end; i += kThreads) {
      const std::uint16_t bin = bin_of(i);
      bins[i] = bin;
      if (bin < kBins) atomicAdd(&next[bin], 1u);
    }
    __syncthreads();
    for (std::uint32_t b = threadIdx.x; b < kBins; b += kThreads) {
      block_bins_[block_ * kBins + b] = next[b];
    }
    sync();
    for (std::uint32_t b = threadIdx.x; b < kBins; b += kThreads) {
      std::uint32_t total = 0, before = 0;
      for (std::uint32_t block = 0; block < blocks_; ++block) {
        if (block == block_) before = total;
        total += block_bins_[block * kBins + b];
      }
      next[b] = before;
      totals[b] = total;
    }
    __syncthreads();
    if (threadIdx.x == 0) {
      std::uint32_t first = 0;
      for (std::uint32_t b = 0; b < kBins; ++b) {
        if (block_ == 0) begin[b] = first;
        next[b] += first;
        first += totals[b];
      }
      if (block_ == 0) begin[kBins] = first;
    }
    __syncthreads();
    for (std::uint32_t i = chunk.begin + threadIdx.x; i < chunk.end; i += kThreads) {
      const std::uint16_t bin = bins[i];
      if (bin < kBins) place(i, atomicAdd(&next[bin], 1u), bin);
    }
    sync();
#endif
  }

  /// Sorts keys and items by key; equal keys keep their order. A radix sort with one pass per digit
  /// of eight bits, except digits that all keys share.
  JFPX_HD void sort(std::uint32_t n, const device::SortedCodes& codes) const {
#if defined(__CUDA_ARCH__)
    device::SortedCodes from = codes;
    for (unsigned shift = 0; shift < 64; shift += 8) {
      if (!sort_by_digit(n, from, shift)) continue;
      from = {from.other_keys, from.keys, from.other_items, from.items};
    }
    if (from.items == codes.items) return;
    for_each(n, [&](std::uint32_t i) {
      codes.keys[i] = codes.other_keys[i];
      codes.items[i] = codes.other_items[i];
    });
#else
    static_cast<void>(n);
    static_cast<void>(codes);
#endif
  }

 private:
  static constexpr unsigned kDigits = 256;  ///< of the radix sort

#if defined(__CUDA_ARCH__)
  /// One pass of the radix sort. @returns false, without effect, if all keys share the digit
  __device__ bool sort_by_digit(std::uint32_t n, const device::SortedCodes& codes,
                                unsigned shift) const {
    static_assert(kThreads == kDigits);
    constexpr unsigned kWarps = kThreads / 32;
    __shared__ std::uint32_t next[kDigits];
    __shared__ std::uint32_t of_warp[kWarps][kDigits];
    const unsigned digit_of_thread = threadIdx.x, warp = threadIdx.x / 32;
    const auto digit_of = [&](std::uint64_t key) {
      return static_cast<unsigned>(key >> shift) % kDigits;
    };
    const device::Range chunk = chunk_of(n);
    next[digit_of_thread] = 0;
    __syncthreads();
    for (std::uint32_t i = chunk.begin + threadIdx.x; i < chunk.end; i += kThreads) {
      atomicAdd(&next[digit_of(codes.keys[i])], 1u);
    }
    __syncthreads();
    block_bins_[block_ * kDigits + digit_of_thread] = next[digit_of_thread];
    sync();
    std::uint32_t total = 0, before = 0;
    for (std::uint32_t block = 0; block < blocks_; ++block) {
      if (block == block_) before = total;
      total += block_bins_[block * kDigits + digit_of_thread];
    }
    std::uint32_t sum = 0;
    const std::uint32_t first = block_scan(total, &sum);
    const bool is_shared = __syncthreads_or(total == n) != 0;
    if (is_shared) {
      sync();
      return false;
    }
    next[digit_of_thread] = first + before;
    for (std::uint32_t tile = chunk.begin; tile < chunk.end; tile += kThreads) {
      for (unsigned w = 0; w < kWarps; ++w) of_warp[w][digit_of_thread] = 0;
      __syncthreads();
      const std::uint32_t i = tile + threadIdx.x;
      const bool is_item = i < chunk.end;
      const std::uint64_t key = is_item ? codes.keys[i] : 0;
      // Threads without an item have a digit of their own.
      const unsigned digit = is_item ? digit_of(key) : kDigits;
      const unsigned same = __match_any_sync(kFullWarp, digit);
      const unsigned rank = __popc(same & lanes_below());
      if (is_item && rank == 0) of_warp[warp][digit] = __popc(same);
      __syncthreads();
      std::uint32_t at = next[digit_of_thread];
      for (unsigned w = 0; w < kWarps; ++w) {
        const std::uint32_t count = of_warp[w][digit_of_thread];
        of_warp[w][digit_of_thread] = at;
        at += count;
      }
      next[digit_of_thread] = at;
      __syncthreads();
      if (is_item) {
        const std::uint32_t to = of_warp[warp][digit] + rank;
        codes.other_keys[to] = key;
        codes.other_items[to] = codes.items[i];
      }
      __syncthreads();
    }
    sync();
    return true;
  }

  __device__ std::uint32_t first() const { return block_ * kThreads + threadIdx.x; }

  /// The chunk of items of this block.
  __device__ device::Range chunk_of(std::uint32_t n) const {
    const std::uint32_t tiles = (n + kThreads - 1) / kThreads;
    const std::uint32_t size = (tiles + blocks_ - 1) / blocks_ * kThreads;
    const std::uint64_t begin = std::uint64_t{block_} * size;
    return {static_cast<std::uint32_t>(begin < n ? begin : n),
            static_cast<std::uint32_t>(begin + size < n ? begin + size : n)};
  }

  /// Exclusive prefix sum of `value` in the block. @param sum receives the sum over all threads
  template <class Number>
  __device__ static Number block_scan(Number value, Number* sum) {
    __shared__ Number warp_sums[kThreads / 32];
    const unsigned warp = threadIdx.x / 32;
    const Number inclusive = warp_inclusive_sum(value);
    if (lane_id() == 31) warp_sums[warp] = inclusive;
    __syncthreads();
    Number before = 0, total = 0;
    for (unsigned w = 0; w < kThreads / 32; ++w) {
      if (w == warp) before = total;
      total += warp_sums[w];
    }
    __syncthreads();
    *sum = total;
    return before + inclusive - value;
  }
  template <class Number>
  __device__ static Number block_sum(Number value) {
    Number sum = 0;
    block_scan(value, &sum);
    return sum;
  }
  /// Sum of the values that the first blocks have published.
  template <class Number>
  __device__ Number sum_of_blocks(std::uint32_t blocks) const {
    Number mine = 0;
    for (std::uint32_t b = threadIdx.x; b < blocks; b += kThreads) {
      mine += static_cast<Number>(block_sums_[b]);
    }
    return block_sum(mine);
  }
#endif

  std::uint64_t* block_sums_;
  std::uint32_t* block_bins_ = nullptr;   ///< by block and bin
  std::uint32_t blocks_ = 1, block_ = 0;  ///< of the team, and this thread's
  bool is_cluster_;
};

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
