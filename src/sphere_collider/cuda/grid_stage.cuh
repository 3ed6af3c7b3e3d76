/// Where contacts wait in the order of cells until their places in the output are known.
#pragma once

#include "src/sphere_collider/cuda/grid_emit.cuh"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

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
static_assert(kStaged < StagedList::kCrowded);
__device__ inline StagedList staged_list(unsigned long long place, unsigned count) {
  return {place << StagedList::kCountBits | count};
}

/// The stage as an output of the same kind as `output`.
__device__ inline SearchOutput stage_of(const GridArgs& args, const SearchOutput& output) {
  if (output.contacts != nullptr) return {args.stage, nullptr, args.capacity, nullptr};
  return {nullptr, reinterpret_cast<SpherePair*>(args.stage), args.capacity, nullptr};
}

static_assert(kBin == kGridThreads);
__device__ inline std::uint32_t bins_of(std::uint32_t n) { return (n - 1) / kBin + 1; }

struct CopyStorage {
  unsigned long long from[kGridThreads], to[kGridThreads];  // minus a contact's number in the tile
  unsigned long long warp_sums[kGridWarps];
  std::uint8_t owners[kStaged * kGridThreads];
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

/// Leaves the sums of kBinsOfSum bins each.
__device__ inline void sum_bins(const GridArgs& args) {
  const std::uint32_t bins = bins_of(args.n);
  const unsigned warps = gridDim.x * kGridWarps;
  for (std::uint32_t sum = blockIdx.x * kGridWarps + threadIdx.x / 32; sum * kBinsOfSum < bins;
       sum += warps) {
    unsigned long long mine = 0;
    for (std::uint32_t k = lane_id(); k < kBinsOfSum; k += 32) {
      if (sum * kBinsOfSum + k < bins) mine += args.bin_sums[sum * kBinsOfSum + k];
    }
    for (unsigned d = 16; d != 0; d /= 2) {
      mine += __shfl_xor_sync(kFullWarp, mine, static_cast<int>(d));
    }
    if (lane_id() == 0) args.count_sums[sum] = mine;
  }
}

/// A block copies the contacts of a bin, a thread an a, from the stage to their places.
__device__ inline void copy_bin(const GridArgs& args, const SearchOutput& output, CopyStorage& s) {
  const std::uint32_t bin = blockIdx.x, first_bin = bin / kBinsOfSum * kBinsOfSum;
  const std::uint32_t a = bin * kBin + threadIdx.x;
  const StagedList list{a < args.n ? args.offsets[a] : 0};
  unsigned long long mine =
      threadIdx.x < bin - first_bin ? args.bin_sums[first_bin + threadIdx.x] : 0;
  for (std::uint32_t k = threadIdx.x; k < bin / kBinsOfSum; k += kGridThreads) {
    mine += args.count_sums[k];
  }
  const unsigned long long before = block_sum(mine, s.warp_sums);
  const std::uint32_t count = list.count(), staged = list.staged();
  // Both sums at once: of what is staged, at most kStaged * kGridThreads, and of all contacts.
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
    args.ranks[a] = count;
    put_off(args, a, count, before + (sums >> kStagedBits));
  }
  __syncthreads();
  static_assert(sizeof(SpherePair) == 8 && sizeof(SphereContact) % 8 == 0);
  if (output.contacts != nullptr) {
    copy_words<sizeof(SphereContact) / 8>(args.stage, output.contacts, all, s);
  } else {
    copy_words<1>(args.stage, output.pairs, all, s);
  }
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
