/// Staging buffer in global memory: holds the contacts of the single-level search, row by row in
/// about the order of cells, until their indices in the output are known.
#pragma once

#include "src/sphere_collider/cuda/grid_emit.cuh"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Location of a row in the staging buffer: index (56 bits) and length (8 bits). For a long row,
/// which is not staged, the second field is kNotStaged and the first field is the length.
struct StagedList {
  static constexpr unsigned kCountBits = 8, kNotStaged = 255;
  unsigned long long bits;
  __device__ bool is_long() const { return (bits & kNotStaged) == kNotStaged; }
  __device__ unsigned long long index() const { return bits >> kCountBits; }
  __device__ std::uint32_t staged() const {
    return is_long() ? 0 : static_cast<std::uint32_t>(bits & kNotStaged);
  }
  __device__ std::uint32_t count() const {
    return static_cast<std::uint32_t>(is_long() ? index() : bits & kNotStaged);
  }
};
static_assert(kMaxStaged < StagedList::kNotStaged);
__device__ inline StagedList staged_list(unsigned long long index, unsigned count) {
  return {index << StagedList::kCountBits | count};
}

/// The staging buffer as an output: of contacts, or of the ids of the neighbors b.
__device__ inline SearchOutput staging_output(const GridArgs& args, const SearchOutput& output) {
  SearchOutput staging{};
  if (output.contacts != nullptr) {
    staging.contacts = args.scratch.staging;
  } else {
    staging.neighbors = reinterpret_cast<std::uint32_t*>(args.scratch.staging);
  }
  return staging;
}

/// Records that row `a`, of the sphere at a position, is longer than the search can stage.
__device__ inline void record_long_row(const GridArgs& args, std::uint32_t a,
                                       std::uint32_t position, std::uint32_t length) {
  args.rows.offsets[a] = staged_list(length, StagedList::kNotStaged).bits;
  args.table.positions[a] = position;
  atomicAdd(&args.state->long_row_contacts, static_cast<unsigned long long>(length));
  atomicAdd(&args.state->overflow, 1ull);
}
/// Records a row that is staged from `index` on, unless it is too long.
__device__ inline void record_row(const GridArgs& args, std::uint32_t a, std::uint32_t position,
                                  std::uint32_t length, unsigned long long index) {
  atomicAdd(&args.rows.bin_sums[a / kBin], static_cast<unsigned long long>(length));
  if (length <= kMaxStaged) {
    args.rows.offsets[a] = staged_list(index, length).bits;
  } else {
    record_long_row(args, a, position, length);
  }
}

/// Lists the row of the sphere at a position for stage_rows_again(). The crowded search does not
/// write a row itself if a lane has no room for its neighbors, and no search does if a distance in
/// a periodic cell is too close to the sum of the radii to decide it from reduced spheres and
/// images: the code for these cases would cost the registers of all.
__device__ inline void list_row_again(const GridArgs& args, std::uint32_t position) {
  args.table.ranks[atomicAdd(&args.state->rows_again, 1u)] = position;
}

static_assert(kBin == kGridThreads);
__device__ inline std::uint32_t bins_of(const GridArgs& args) {
  return (args.input.rows() - 1) / kBin + 1;
}

/// Number of staged contacts of a bin that a block copies at a time: most bins have fewer.
inline constexpr std::uint32_t kOwned = 60 * kGridThreads;

struct CopyStorage {
  // Start of a row in the staging buffer and in the output, each minus its start in the bin.
  unsigned long long from[kGridThreads], to[kGridThreads];
  BlockSums::TempStorage sums;
  std::uint8_t owners[kOwned];             // rows of kOwned consecutive staged contacts of the bin
  std::uint8_t shift_codes[kGridThreads];  // of the spheres of the rows, in a periodic cell
};

/// A block copies some staged contacts of a bin, whose owners are known, to the output.
__device__ inline void copy_contacts(const SphereContact* staging, SphereContact* output,
                                     std::uint32_t first, std::uint32_t past,
                                     const CopyStorage& s) {
  constexpr unsigned kAtOnce = 4, kWords = sizeof(SphereContact) / 8;
  static_assert(sizeof(SphereContact) % 8 == 0);
  const auto* const from = reinterpret_cast<const unsigned long long*>(staging);
  auto* const to = reinterpret_cast<unsigned long long*>(output);
  const std::uint32_t words = (past - first) * kWords;
  for (std::uint32_t begin = threadIdx.x; begin < words; begin += kAtOnce * kGridThreads) {
    unsigned long long values[kAtOnce], indices[kAtOnce];
#pragma unroll
    for (unsigned k = 0; k < kAtOnce; ++k) {
      const std::uint32_t w = min(begin + k * kGridThreads, words - 1), record = w / kWords;
      const unsigned owner = s.owners[record], word = w % kWords;
      values[k] = from[(s.from[owner] + first + record) * kWords + word];
      indices[k] = (s.to[owner] + first + record) * kWords + word;
    }
#pragma unroll
    for (unsigned k = 0; k < kAtOnce; ++k) {
      if (begin + k * kGridThreads < words) to[indices[k]] = values[k];
    }
  }
}

/// Whether the search writes the shifts of pairs in a periodic cell.
template <bool kPeriodic>
__device__ bool writes_shifts(const GridArgs& args, const SearchOutput& output) {
  return kPeriodic && output.rows.shifts != nullptr && args.input.periodic.known->has_shift_codes;
}

/// Writes the shifts of the pairs of a warp.
/// @param to index of the pair of this lane in the output
/// @param codes the shift code of its image, and above it that of its sphere
/// @param count of the lanes that have a pair
__device__ inline void write_pair_shifts(std::int32_t* shifts, unsigned long long to,
                                         std::uint32_t codes, std::uint32_t count) {
  const unsigned long long first = __shfl_sync(kFullWarp, to, 0);
  // There is a gap between pairs of rows that precede and follow a long row.
  const bool has_gap = __any_sync(kFullWarp, lane_id() < count && to != first + lane_id());
#pragma unroll
  for (unsigned k = 0; k < 3; ++k) {  // a store of a warp writes consecutive elements
    const unsigned element = 32 * k + lane_id(), pair = element / 3, axis = element % 3;
    const std::uint32_t both = __shfl_sync(kFullWarp, codes, static_cast<int>(pair));
    unsigned long long at = first + pair;
    if (has_gap) at = __shfl_sync(kFullWarp, to, static_cast<int>(pair));
    if (pair < count) {
      __stcs(shifts + 3 * at + axis, shift_between(both >> kShiftBits, both, axis));
    }
  }
}

/// copy_contacts() for pairs, of whose second spheres or images the ids are staged. The first row
/// of the bin is first_a.
template <bool kPeriodic>
__device__ void copy_pairs(const GridArgs& args, const std::uint32_t* staging,
                           const SearchOutput& output, std::uint32_t first_a, std::uint32_t first,
                           std::uint32_t past, const CopyStorage& s) {
  constexpr unsigned kAtOnce = 4;
  const bool has_shifts = writes_shifts<kPeriodic>(args, output);
  for (std::uint32_t begin = first + threadIdx.x; begin - lane_id() < past;
       begin += kAtOnce * kGridThreads) {
    std::uint32_t ids[kAtOnce], owners[kAtOnce];
#pragma unroll
    for (unsigned k = 0; k < kAtOnce; ++k) {
      const std::uint32_t i = min(begin + k * kGridThreads, past - 1);
      owners[k] = s.owners[i - first];
      ids[k] = staging[s.from[owners[k]] + i];
    }
#pragma unroll
    for (unsigned k = 0; k < kAtOnce; ++k) {
      const std::uint32_t i = begin + k * kGridThreads;
      const unsigned long long to = s.to[owners[k]] + i;
      if (i < past) {
        write_pair(output, to, first_a + owners[k], index_of<kPeriodic>(args.input, ids[k]));
      }
      if constexpr (kPeriodic) {
        const std::uint32_t of_warp = i - lane_id();
        if (has_shifts && of_warp < past) {
          const std::uint32_t codes =
              shift_code_of(ids[k]) | std::uint32_t{s.shift_codes[owners[k]]} << kShiftBits;
          write_pair_shifts(output.rows.shifts, to, codes, past - of_warp);
        }
      }
    }
  }
}

/// Sums the pairs of each group of kBinsOfSum bins.
__device__ inline void sum_bins(const GridArgs& args) {
  const std::uint32_t bins = bins_of(args);
  const unsigned warps = gridDim.x * kGridWarps;
  for (std::uint32_t sum = blockIdx.x * kGridWarps + threadIdx.x / 32; sum * kBinsOfSum < bins;
       sum += warps) {
    unsigned long long mine = 0;
    for (std::uint32_t k = lane_id(); k < kBinsOfSum; k += 32) {
      if (sum * kBinsOfSum + k < bins) mine += args.rows.bin_sums[sum * kBinsOfSum + k];
    }
    mine = warp_sum(mine);
    if (lane_id() == 0) args.rows.sums[sum] = mine;
  }
}

/// The number of contacts in all bins before `bin`, from sum_bins().
__device__ inline unsigned long long contacts_before(const GridArgs& args, std::uint32_t bin,
                                                     CopyStorage& s) {
  const std::uint32_t first_bin = bin / kBinsOfSum * kBinsOfSum;
  unsigned long long mine =
      threadIdx.x < bin - first_bin ? args.rows.bin_sums[first_bin + threadIdx.x] : 0;
  for (std::uint32_t k = threadIdx.x; k < bin / kBinsOfSum; k += kGridThreads) {
    mine += args.rows.sums[k];
  }
  return block_sum(mine, s.sums);
}

/// A part of the staged contacts of a bin: that with this index, if they are divided evenly.
struct BinPart {
  std::uint32_t index = 0, parts = 1;
};

/// A block lists the long rows of a bin for a later phase. They follow the `before` contacts of
/// earlier bins.
/// @return the number of contacts of the bin
__device__ inline unsigned long long defer_long_rows(const GridArgs& args, std::uint32_t bin,
                                                     unsigned long long before, CopyStorage& s) {
  const std::uint32_t a = bin * kBin + threadIdx.x;
  const StagedList list{a < args.input.rows() ? args.rows.offsets[a] : 0};
  unsigned long long total = 0;
  const unsigned long long sum =
      block_exclusive_sum(static_cast<unsigned long long>(list.count()), s.sums, total);
  if (list.is_long()) {
    args.table.ranks[a] = list.count();
    defer_row(args, a, list.count(), before + sum);
  }
  return total;
}

/// A block copies the rows of a bin, or a part of their contacts, from the staging buffer to the
/// output, after the `before` contacts of earlier bins.
/// @return the number of contacts of the bin
template <bool kPeriodic>
__device__ unsigned long long copy_bin(const GridArgs& args, const SearchOutput& output,
                                       std::uint32_t bin, unsigned long long before, CopyStorage& s,
                                       const BinPart& part = {}) {
  const std::uint32_t a = bin * kBin + threadIdx.x;
  const StagedList list{a < args.input.rows() ? args.rows.offsets[a] : 0};
  const std::uint32_t count = list.count(), staged = list.staged();
  // One scan computes two sums: of staged contacts (low bits, at most kMaxStaged * kGridThreads),
  // and of all contacts.
  constexpr unsigned kStagedBits = 16;
  static_assert(kMaxStaged * kGridThreads < 1u << kStagedBits);
  unsigned long long total = 0;
  const unsigned long long sums = block_exclusive_sum(
      static_cast<unsigned long long>(count) << kStagedBits | staged, s.sums, total);
  const auto start = static_cast<std::uint32_t>(sums & ((1u << kStagedBits) - 1));
  const auto all = static_cast<std::uint32_t>(total & ((1u << kStagedBits) - 1));
  s.from[threadIdx.x] = list.index() - start;
  s.to[threadIdx.x] = before + (sums >> kStagedBits) - start;
  if constexpr (kPeriodic) {
    if (writes_shifts<true>(args, output) && a < args.input.rows()) {
      s.shift_codes[threadIdx.x] =
          static_cast<std::uint8_t>(shift_code_of(args.input.periodic.ids[a]));
    }
  }
  const std::uint32_t end = all * (part.index + 1) / part.parts;
  for (std::uint32_t first = all * part.index / part.parts; first < end; first += kOwned) {
    const std::uint32_t past = min(first + kOwned, end);
    for (std::uint32_t k = max(start, first); k < min(start + staged, past); ++k) {
      s.owners[k - first] = static_cast<std::uint8_t>(threadIdx.x);
    }
    __syncthreads();
    if (!kPeriodic && output.contacts != nullptr) {
      copy_contacts(args.scratch.staging, output.contacts, first, past, s);
    } else {
      copy_pairs<kPeriodic>(args, reinterpret_cast<const std::uint32_t*>(args.scratch.staging),
                            output, bin * kBin, first, past, s);
    }
    __syncthreads();
  }
  return total >> kStagedBits;
}

/// Calls visit(bin, before, part) for all parts of all bins, distributed over all blocks of the
/// kernel. There are `before` contacts in earlier bins. @param visit returns those of the bin
template <typename Visit>
__device__ void visit_bins(const GridArgs& args, std::uint32_t parts, CopyStorage& s, Visit visit) {
  const std::uint64_t all = std::uint64_t{bins_of(args)} * parts;
  const auto first = static_cast<std::uint32_t>(all * blockIdx.x / gridDim.x),
             past = static_cast<std::uint32_t>(all * (blockIdx.x + 1) / gridDim.x);
  if (first == past) return;
  unsigned long long mine = 0;
  for (std::uint32_t k = threadIdx.x; k < first / parts; k += kGridThreads) {
    mine += args.rows.bin_sums[k];
  }
  unsigned long long before = block_sum(mine, s.sums);
  for (std::uint32_t i = first; i < past; ++i) {
    const BinPart part{i % parts, parts};
    const unsigned long long contacts = visit(i / parts, before, part);
    if (part.index == parts - 1) before += contacts;
    __syncthreads();
  }
}

/// Copies all bins, which are divided if there are few.
template <bool kPeriodic>
__device__ void copy_bins(const GridArgs& args, const SearchOutput& output, CopyStorage& s) {
  const std::uint32_t parts = min(max(kCopiesOfBlock * gridDim.x / bins_of(args), 1u), kMaxParts);
  visit_bins(args, parts, s,
             [&](std::uint32_t bin, unsigned long long before, const BinPart& part) {
               return copy_bin<kPeriodic>(args, output, bin, before, s, part);
             });
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
