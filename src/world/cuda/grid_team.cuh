/// The threads of a cooperative launch that run the program of a device step.
#pragma once

#include "src/base/atomic.hpp"
#include "src/base/cuda/warp.cuh"
#include "src/world/device/shared_memory.hpp"
#include "src/world/device/step_data.hpp"

#include <cooperative_groups.h>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Where the blocks of a device wait for those of the other devices of a launch.
struct alignas(128) DeviceBarrier {
  /// The upper half counts the barriers at which all blocks of the device have arrived.
  std::uint32_t arrived;
  std::uint32_t signals[device::kMostParts];  ///< by part: its `arrived` after its last block
  alignas(128) std::uint32_t passed;  ///< `arrived` of the last barrier at which all have arrived
  std::uint32_t ended;                ///< not 0: the kernels end
};

/// The devices that run a program together.
struct TeamParts {
  std::uint32_t count = 1;                           ///< number of devices
  std::uint32_t mine = 0;                            ///< number of this device
  DeviceBarrier* barriers[device::kMostParts] = {};  ///< by part, in the memory of its device
  /// In the memory of the host; not 0: the kernels end at the barrier.
  const std::uint32_t* ended = nullptr;
};

/// Loops over items. All threads must call the same functions with the same item counts. scan() and
/// partition() assign consecutive chunks of items to the blocks.
///
/// Several devices may run a program together: each is a **part** of the team, with the same number
/// of blocks, and the loops give consecutive items to each part.
class GridTeam {
 public:
  static constexpr unsigned kThreads = device::tuning::kThreads;

  /// Words of scratch memory for a launch with this number of blocks on all devices.
  static std::size_t scratch_words(unsigned blocks) { return std::size_t{blocks} * (2 + kDigits); }

  /// @param scratch device memory of scratch_words()
  /// @param is_cluster whether all blocks are one cluster, whose barrier is faster
  /// @param parts the devices of the launch
  JFPX_HD GridTeam(std::uint32_t* scratch, bool is_cluster, const TeamParts& parts)
      : all_(&parts),
        block_sums_(reinterpret_cast<std::uint64_t*>(scratch)),
        parts_(parts.count),
        part_(parts.mine),
        is_cluster_(is_cluster) {
#if defined(__CUDA_ARCH__)
    blocks_ = parts.count * gridDim.x;
    blocks_of_part_ = gridDim.x;
    block_ = parts.mine * gridDim.x + blockIdx.x;
    block_bins_ = scratch + 2 * blocks_;
#endif
  }

  /// Barrier of all threads. Writes before it are visible to all threads after it.
  JFPX_HD void sync() const {
#if defined(__CUDA_ARCH__)
    if (all_ == nullptr) {
      if (has_peer_memory_) __threadfence_system();  // completes atomic operations there
      __syncthreads();
      return;
    }
    if (all_->count > 1) {
      sync_devices(*all_);
      return;
    }
    if (gridDim.x == 1) {
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
  /// sync() if there are several devices. A program begins and ends with it, so that it follows all
  /// work in the stream of the first device, and precedes all later work there.
  JFPX_HD void sync_parts() const {
#if defined(__CUDA_ARCH__)
    if (all_->count > 1) sync_devices(*all_);
#endif
  }

  /// Number of the part of this thread.
  JFPX_HD std::uint32_t part() const { return part_; }
  /// The threads of the part of this thread as a team. Its barriers are those of all parts, so all
  /// parts must have the same number of them.
  JFPX_HD GridTeam team_of_part() const {
    GridTeam team = *this;
#if defined(__CUDA_ARCH__)
    team.block_sums_ += part_ * gridDim.x;
    team.block_ -= part_ * gridDim.x;
    team.blocks_ = gridDim.x;
    team.parts_ = 1;
    team.part_ = 0;
#endif
    return team;
  }

  /// Number of warps of the team.
  JFPX_HD std::uint32_t warps() const { return blocks_ * kWarps; }

  /// Copies the bins of the part of this thread to shared memory. At most one copy exists at a
  /// time.
  /// @param bins by part
  JFPX_HD const device::RowBins& cached_bins(const device::RowBins* bins) const {
#if defined(__CUDA_ARCH__)
    __shared__ device::RowBins copy;
    constexpr std::uint32_t kWords = sizeof(device::RowBins) / sizeof(std::uint32_t);
    const auto* from = reinterpret_cast<const std::uint32_t*>(&bins[part_]);
    auto* to = reinterpret_cast<std::uint32_t*>(&copy);
    for (std::uint32_t i = threadIdx.x; i < kWords; i += kThreads) to[i] = from[i];
    __syncthreads();
    return copy;
#else
    return *bins;
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
    JFPX_HD void* shared(std::size_t) const { return device::dynamic_shared_memory(); }
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
    /// Replaces each of n numbers by the sum of those before it. Begins after a barrier, and ends
    /// with one. @returns the sum of all
    JFPX_HD std::uint32_t scan([[maybe_unused]] std::uint32_t n,
                               [[maybe_unused]] std::uint32_t* numbers) const {
      std::uint32_t before = 0;
#if defined(__CUDA_ARCH__)
      for (std::uint32_t tile = 0; tile < n; tile += kThreads) {
        const std::uint32_t i = tile + threadIdx.x;
        std::uint32_t sum = 0;
        const std::uint32_t first = before + block_scan(i < n ? numbers[i] : 0u, &sum);
        if (i < n) numbers[i] = first;
        before += sum;
      }
      __syncthreads();
#endif
      return before;
    }
    /// Calls f(thread, number of threads, sync) in each thread; all must call sync() equally often.
    template <class F>
    [[gnu::always_inline]] JFPX_HD void for_each_thread(const F& f) const {
#if defined(__CUDA_ARCH__)
      f(threadIdx.x, kThreads, [] { __syncthreads(); });
#endif
    }
  };

  /// The threads of the block of this thread.
  JFPX_HD Threads threads() const { return {}; }

  /// Calls f(block, threads) for all blocks < n of a partition of work, in ascending order, each
  /// with the threads of one block of the launch. All calls with the same n assign a block to the
  /// same threads. The threads of a block wait for each other, but not for other blocks.
  /// @param division see device::range_of_part()
  template <class F>
  [[gnu::always_inline]] JFPX_HD void for_blocks(std::uint32_t n, const F& f,
                                                 const device::Division* division) const {
#if defined(__CUDA_ARCH__)
    const device::Range mine = range_of_part(n, division);
    for (std::uint32_t block = mine.begin + block_in_part(); block < mine.end;
         block += blocks_of_part_) {
      f(block, Threads());
      __syncthreads();
    }
#endif
  }

  /// Calls f(i) for all i < n, in any order, without a barrier.
  /// @param division see device::range_of_part()
  template <class F>
  JFPX_HD void for_each_nowait(std::uint32_t n, const F& f,
                               const device::Division* division = nullptr) const {
#if defined(__CUDA_ARCH__)
    const device::Range mine = range_of_part(n, division);
    const std::uint32_t threads = blocks_of_part_ * kThreads;
    for (std::uint32_t i = mine.begin + thread_in_part(); i < mine.end; i += threads) f(i);
#endif
  }
  /// for_each_nowait() for items that take different branches, which a warp executes one after the
  /// other: if there are fewer items than threads, each warp has as few of them as possible.
  template <class F>
  JFPX_HD void for_each_divergent(std::uint32_t n, const F& f,
                                  const device::Division* division = nullptr) const {
#if defined(__CUDA_ARCH__)
    const device::Range mine = range_of_part(n, division);
    const std::uint32_t count = mine.end - mine.begin;
    const std::uint32_t warps = blocks_of_part_ * kWarps, most = (count + warps - 1) / warps;
    const std::uint32_t lanes = most < kLanes ? most : kLanes;
    if (lane_id() >= lanes) return;
    const std::uint32_t start = thread_in_part() / kLanes * lanes + lane_id();
    for (std::uint32_t i = start; i < count; i += warps * lanes) f(mine.begin + i);
#endif
  }
  /// Calls f(i) for all i < n, in any order, then waits for all threads.
  template <class F>
  JFPX_HD void for_each(std::uint32_t n, const F& f,
                        const device::Division* division = nullptr) const {
    for_each_nowait(n, f, division);
    sync();
  }
  /// Calls f(thread, number of threads, sync) in each thread, with numbers in its part; all must
  /// call sync() equally often.
  template <class F>
  [[gnu::always_inline]] JFPX_HD void for_each_thread(const F& f) const {
#if defined(__CUDA_ARCH__)
    f(thread_in_part(), blocks_of_part_ * kThreads, [&] { sync(); });
#endif
  }
  /// Calls f in one thread, without a barrier.
  template <class F>
  JFPX_HD void once(const F& f) const {
#if defined(__CUDA_ARCH__)
    if (block_ == 0 && part_ == 0 && threadIdx.x == 0) f();
#endif
  }
  /// Calls f(team) with the threads of one block as a team, whose barriers are faster. No barrier
  /// follows.
  template <class F>
  JFPX_HD void in_one_block(const F& f) const {
#if defined(__CUDA_ARCH__)
    if (block_ != 0) return;
    GridTeam team = *this;
    team.all_ = nullptr;
    team.has_peer_memory_ = parts_ > 1;
    team.blocks_ = team.blocks_of_part_ = team.parts_ = 1;
    f(team);
#endif
  }

  /// Dataflow without a barrier: for all i < n, starts an item with begin(i, &item), waits until
  /// is_ready(item), and calls complete(item). An item may wait for items of lower warps (32 items
  /// each) and of earlier calls. All calls with the same n assign item i to the same thread; once()
  /// always uses the same thread. Only for one part.
  template <class Dataflow>
  [[gnu::always_inline]] JFPX_HD void run_dataflow(std::uint32_t n,
                                                   const Dataflow& dataflow) const {
#if defined(__CUDA_ARCH__)
    // Consecutive warps are in different blocks, so that a few items use several multiprocessors.
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
  JFPX_HD void count(std::uint32_t n, const Condition& condition, std::uint32_t* sum,
                     const device::Division* division = nullptr) const {
#if defined(__CUDA_ARCH__)
    std::uint32_t mine = 0;
    const auto add = [&](std::uint32_t i) {
      if (condition(i)) ++mine;
    };
    for_each_nowait(n, add, division);
    mine = warp_sum(mine);
    if (lane_id() == 0 && mine > 0) atomic_add(sum, mine);
#endif
  }

  /// Calls place(i, size(0) + ... + size(i - 1)) for all i < n. The size of an item is measure(i)
  /// in the first pass, called once, and size(i) in later passes. @returns the sum of all sizes
  template <class Measure, class Size, class Place>
  JFPX_HD auto scan(std::uint32_t n, const Measure& measure, const Size& size, const Place& place,
                    const device::Division* division = nullptr) const -> decltype(size(0)) {
    using Number = decltype(size(0));
#if defined(__CUDA_ARCH__)
    const device::Range chunk = chunk_of(n, division);
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

  /// Calls place(i, position, bin) for all items i with bin_of(i) < device::kBins. The positions of
  /// a part are consecutive, ascend by bin, and start at a multiple of `capacity`. The order within
  /// a bin is arbitrary.
  /// Uses device::kBytesOfBins of the shared memory of a block.
  /// @param lists  two lists of items, each of which is divided among the blocks of the launch
  /// @param bins   receives for each item part * (kBins + 1) + bin, or what bin_of() returns if it
  ///   is not a bin
  /// @param states by part, with bin_sizes of 0, which receive the sizes
  /// @param begin  by part, receives the first position of each bin, and the end
  /// @param bin_of called once for each item
  /// @param part_of called once for each item that has a bin
  template <class BinOf, class PartOf, class Place>
  JFPX_HD void partition(const device::TwoLists& lists, std::uint16_t* bins,
                         device::PartState* const* states, device::RowBins* begin,
                         std::uint32_t capacity, const BinOf& bin_of, const PartOf& part_of,
                         const Place& place) const {
#if defined(__CUDA_ARCH__)
    constexpr std::uint32_t kStride = device::kBins + 1;
    auto* const next = static_cast<std::uint32_t*>(Threads().shared(device::kBytesOfBins));
    const device::Range of_first = chunk_of(lists.first, lists.division_of_first),
                        of_second = chunk_of(lists.second, lists.division_of_second);
    const std::uint32_t first_count = of_first.end - of_first.begin,
                        count = first_count + of_second.end - of_second.begin;
    const auto item = [&](std::uint32_t k) {
      return k < first_count ? of_first.begin + k
                             : lists.first + of_second.begin + (k - first_count);
    };
    for (std::uint32_t b = threadIdx.x; b < parts_ * kStride; b += kThreads) next[b] = 0;
    __syncthreads();
    for (std::uint32_t k = threadIdx.x; k < count; k += kThreads) {
      const std::uint32_t i = item(k);
      std::uint16_t bin = bin_of(i);
      if (bin < device::kBins) {
        if (parts_ > 1) bin += static_cast<std::uint16_t>(part_of(i, bin) * kStride);
        atomicAdd(&next[bin], 1u);
      }
      bins[i] = bin;
    }
    __syncthreads();
    for (std::uint32_t b = threadIdx.x; b < parts_ * kStride; b += kThreads) {
      if (next[b] > 0) next[b] = atomic_add(&states[part_]->bin_sizes[b], next[b]);
    }
    sync();
    for (std::uint32_t part = 0; part < parts_; ++part) {
      std::uint32_t before = part * capacity;
      for (std::uint32_t tile = 0; tile < kStride; tile += kThreads) {
        const std::uint32_t b = tile + threadIdx.x;
        std::uint32_t sum = 0;
        std::uint32_t size = 0, of_lower_parts = 0;
        for (std::uint32_t from = 0; from < parts_ && b < kStride; ++from) {
          if (from == part_) of_lower_parts = size;
          size += states[from]->bin_sizes[part * kStride + b];
        }
        const std::uint32_t first = before + block_scan(size, &sum);
        before += sum;
        if (b >= kStride) continue;
        next[part * kStride + b] += first + of_lower_parts;
        if (block_ == 0) begin[part].begin[b] = first;
      }
    }
    __syncthreads();
    for (std::uint32_t k = threadIdx.x; k < count; k += kThreads) {
      const std::uint32_t i = item(k);
      const std::uint16_t bin = bins[i];
      if (bin < device::kMostParts * kStride) {
        place(i, atomicAdd(&next[bin], 1u), static_cast<std::uint16_t>(bin % kStride));
      }
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
  static constexpr unsigned kDigits = 256;               ///< of the radix sort
  static constexpr unsigned kLanes = 32;                 ///< of a warp
  static constexpr unsigned kWarps = kThreads / kLanes;  ///< of a block

#if defined(__CUDA_ARCH__)
  /// One pass of the radix sort. @returns false, without effect, if all keys share the digit
  __device__ bool sort_by_digit(std::uint32_t n, const device::SortedCodes& codes,
                                unsigned shift) const {
    static_assert(kThreads == kDigits);
    __shared__ std::uint32_t next[kDigits];
    __shared__ std::uint32_t of_warp[kWarps][kDigits];
    const unsigned digit_of_thread = threadIdx.x, warp = threadIdx.x / kLanes;
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

  __device__ std::uint32_t block_in_part() const { return block_ - part_ * blocks_of_part_; }
  __device__ std::uint32_t thread_in_part() const {
    return block_in_part() * kThreads + threadIdx.x;
  }
  /// The items of the part of this thread.
  __device__ device::Range range_of_part(std::uint32_t n,
                                         const device::Division* division = nullptr) const {
    return device::range_of_part(n, part_, parts_, division);
  }

  /// Barrier of all blocks of all devices. The last block of each device exchanges signals with the
  /// other devices, so that only two fences of a device are of the whole system: such a fence waits
  /// for all outstanding accesses to other devices.
  __noinline__ __device__ static void sync_devices(const TeamParts& all) {
    __syncthreads();
    bool ends = false;
    if (threadIdx.x == 0) {
      constexpr std::uint32_t kBarrier = 0x10000u;
      DeviceBarrier* const barrier = all.barriers[all.mine];
      __threadfence();  // the last block makes the writes of all visible to other devices
      const std::uint32_t increment = blockIdx.x == 0 ? kBarrier - (gridDim.x - 1) : 1;
      const std::uint32_t before = atomic_add(&barrier->arrived, increment);
      const std::uint32_t after = before + increment;
      if (before / kBarrier != after / kBarrier) {
        wait_for_devices(all, barrier, after);
        store_shared(&barrier->passed, after);
      } else {
        while (!has_passed(&barrier->passed, before)) {
        }
      }
      __threadfence();
      ends = load_shared(&barrier->ended) != 0;
    }
    if (__syncthreads_or(ends ? 1 : 0) != 0) asm volatile("exit;");
  }

  /// Whether a word of DeviceBarrier has passed the barrier that follows `before`. It may already
  /// be at the next barrier.
  __device__ static bool has_passed(const std::uint32_t* word, std::uint32_t before) {
    const std::uint32_t barriers = (load_shared(word) >> 16) - (before >> 16);
    return static_cast<std::int16_t>(barriers) > 0;
  }
  /// Signals to the other devices that all blocks of this one have arrived, and waits for theirs.
  /// @param arrived DeviceBarrier::arrived of this device
  __device__ static void wait_for_devices(const TeamParts& all, DeviceBarrier* barrier,
                                          std::uint32_t arrived) {
    constexpr std::uint32_t kPollsPerLook = 1024;
    const std::uint32_t mine = all.mine, count = all.count;
    __threadfence_system();
    for (std::uint32_t part = 0; part < count; ++part) {
      if (part != mine) store_shared(&all.barriers[part]->signals[mine], arrived);
    }
    for (std::uint32_t part = 0; part < count; ++part) {
      if (part == mine) continue;
      const std::uint32_t before = arrived - 0x10000u;
      for (std::uint32_t polls = 1; !has_passed(&barrier->signals[part], before); ++polls) {
        if (polls % kPollsPerLook != 0 || load_shared(all.ended) == 0) continue;
        store_shared(&barrier->ended, 1u);
        __threadfence();
        return;
      }
    }
    __threadfence_system();
  }

  /// The chunk of items of this block.
  __device__ device::Range chunk_of(std::uint32_t n,
                                    const device::Division* division = nullptr) const {
    const device::Range mine = range_of_part(n, division);
    const std::uint32_t count = mine.end - mine.begin, blocks = blocks_of_part_;
    const std::uint32_t tiles = (count + kThreads - 1) / kThreads;
    const std::uint32_t size = (tiles + blocks - 1) / blocks * kThreads;
    const std::uint64_t begin = std::uint64_t{block_in_part()} * size;
    const auto item = [&](std::uint64_t i) {
      return mine.begin + static_cast<std::uint32_t>(i < count ? i : count);
    };
    return {item(begin), item(begin + size)};
  }

  /// Exclusive prefix sum of `value` in the block. @param sum receives the sum over all threads
  template <class Number>
  __device__ static Number block_scan(Number value, Number* sum) {
    __shared__ Number warp_sums[kWarps];
    const unsigned warp = threadIdx.x / kLanes;
    const Number inclusive = warp_inclusive_sum(value);
    if (lane_id() == kLanes - 1) warp_sums[warp] = inclusive;
    __syncthreads();
    Number before = 0, total = 0;
    for (unsigned w = 0; w < kWarps; ++w) {
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

  const TeamParts* all_;  ///< of the launch; null: a team of one block
  std::uint64_t* block_sums_;
  std::uint32_t* block_bins_ = nullptr;   ///< by block and digit
  std::uint32_t blocks_ = 1, block_ = 0;  ///< of the team, and this thread's
  std::uint32_t blocks_of_part_ = 1;
  std::uint32_t parts_, part_;    ///< of the team, and this thread's
  bool has_peer_memory_ = false;  ///< whether a team of one block uses memory of other devices
  bool is_cluster_;
};

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
