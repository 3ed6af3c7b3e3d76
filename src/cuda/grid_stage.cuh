/// Where contacts wait in the order of cells until their places in the output are known.
#pragma once

#include "src/cuda/grid_emit.cuh"

namespace jfpx::inline JFPX_ABI::cuda {

/// Where the stage has the contacts of a sphere: 59 bits place, 5 bits count. If the sphere is
/// crowded it has none there, and the place is their number.
struct StagedList {
  static constexpr unsigned kCountBits = 5, kCrowded = 31;
  unsigned long long bits;
  __device__ bool is_crowded() const { return (bits & kCrowded) == kCrowded; }
  __device__ unsigned long long place() const { return bits >> kCountBits; }
  __device__ std::uint32_t staged() const {
    return is_crowded() ? 0 : static_cast<std::uint32_t>(bits & kCrowded);
  }
  __device__ std::uint32_t count() const {
    return static_cast<std::uint32_t>(is_crowded() ? place() : bits & kCrowded);
  }
};
static_assert(kSlots < StagedList::kCrowded);
__device__ inline StagedList staged_list(unsigned long long place, unsigned count) {
  return {place << StagedList::kCountBits | count};
}

/// The stage as an output of the same kind as `output`.
__device__ inline SearchOutput stage_of(const GridArgs& args, const SearchOutput& output) {
  if (output.contacts != nullptr) return {args.stage, nullptr, args.capacity, nullptr};
  return {nullptr, reinterpret_cast<SpherePair*>(args.stage), args.capacity, nullptr};
}

/// Blocks that share out the lists of contacts.
inline constexpr unsigned kCopyBlocks = 132 * 8;
static_assert(kCopyBlocks <= kMostGridBlocks);

struct CopyStorage {
  unsigned long long from[kGridThreads], to[kGridThreads];  // minus a contact's number in the tile
  unsigned long long warp_sums[kGridWarps];
  std::uint8_t owners[kSlots * kGridThreads];
};

/// A block copies `count` records of kWords words each.
template <unsigned kWords>
__device__ inline void copy_words(const void* stage, void* output, std::uint32_t count,
                                  const CopyStorage& s) {
  constexpr unsigned kAtOnce = 4;
  const auto* const from = static_cast<const unsigned long long*>(stage);
  auto* const to = static_cast<unsigned long long*>(output);
  const std::uint32_t words = count * kWords;
  for (std::uint32_t first = threadIdx.x; first < words; first += kAtOnce * kGridThreads) {
    unsigned long long values[kAtOnce], places[kAtOnce];
#pragma unroll
    for (unsigned k = 0; k < kAtOnce; ++k) {
      const std::uint32_t w = min(first + k * kGridThreads, words - 1), record = w / kWords;
      const unsigned owner = s.owners[record], word = w % kWords;
      values[k] = from[(s.from[owner] + record) * kWords + word];
      places[k] = (s.to[owner] + record) * kWords + word;
    }
#pragma unroll
    for (unsigned k = 0; k < kAtOnce; ++k) {
      if (first + k * kGridThreads < words) to[places[k]] = values[k];
    }
  }
}

/// A block copies the contacts of kGridThreads consecutive a's, one a thread, from the stage to
/// their places. Returns their number.
__device__ inline unsigned long long copy_tile(const GridArgs& args, const SearchOutput& output,
                                               std::uint64_t a, StagedList list,
                                               unsigned long long before, CopyStorage& s) {
  __syncthreads();
  const std::uint32_t count = list.count(), staged = list.staged();
  // Both sums at once: of what is staged, at most kSlots * kGridThreads, and of all contacts.
  constexpr unsigned kStagedBits = 16;
  unsigned long long total = 0;
  const unsigned long long sums = block_exclusive_sum(
      static_cast<unsigned long long>(count) << kStagedBits | staged, s.warp_sums, total);
  const auto start = static_cast<std::uint32_t>(sums & ((1u << kStagedBits) - 1));
  const auto all = static_cast<std::uint32_t>(total & ((1u << kStagedBits) - 1));
  s.from[threadIdx.x] = list.place() - start;
  s.to[threadIdx.x] = before + (sums >> kStagedBits) - start;
  for (std::uint32_t k = 0; k < staged; ++k) {
    s.owners[start + k] = static_cast<std::uint8_t>(threadIdx.x);
  }
  if (list.is_crowded()) {
    const auto sphere = static_cast<std::uint32_t>(a);
    args.ranks[sphere] = count;
    put_off(args, sphere, count, before + (sums >> kStagedBits));
  }
  __syncthreads();
  static_assert(sizeof(SpherePair) == 8 && sizeof(SphereContact) % 8 == 0);
  if (output.contacts != nullptr) {
    copy_words<sizeof(SphereContact) / 8>(args.stage, output.contacts, all, s);
  } else {
    copy_words<1>(args.stage, output.pairs, all, s);
  }
  return total >> kStagedBits;
}

/// Leaves the number of contacts of each block's a's.
__device__ inline void sum_lists(const GridArgs& args, CopyStorage& s) {
  const Span span = span_of_block(args.n, kGridThreads, kCopyBlocks);
  unsigned long long sum = 0;
  for (std::uint64_t a = span.first + threadIdx.x; a < span.past; a += kGridThreads) {
    sum += StagedList{args.offsets[a]}.count();
  }
  sum = block_sum(sum, s.warp_sums);
  if (threadIdx.x == 0) args.count_sums[blockIdx.x] = sum;
}

__device__ inline void copy_lists(const GridArgs& args, const SearchOutput& output,
                                  CopyStorage& s) {
  const Span span = span_of_block(args.n, kGridThreads, kCopyBlocks);
  unsigned long long before = sum_of_blocks_before(args.count_sums, s.warp_sums);
  const auto list_of = [&](std::uint64_t a) {
    return StagedList{a < span.past ? args.offsets[a] : 0};
  };
  std::uint64_t a = span.first + threadIdx.x;
  StagedList list = list_of(a);
  for (std::uint64_t first = span.first; first < span.past; first += kGridThreads) {
    const StagedList next = list_of(a + kGridThreads);
    before += copy_tile(args, output, a, list, before, s);
    list = next;
    a += kGridThreads;
  }
}

}  // namespace jfpx::inline JFPX_ABI::cuda
