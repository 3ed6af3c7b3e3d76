/// Last phases of the grid search: writes the neighbors of each sphere as contacts in the order
/// of (a, b). Row a starts in the output at the sum of the lengths of all lower rows, so that only
/// the b's of each row need to be sorted.
#pragma once

#include "src/sphere_collider/cuda/grid.cuh"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

inline constexpr std::uint32_t kWindowWords = 1024;  // words of the bit set of a window
inline constexpr std::uint32_t kWindow = 32 * kWindowWords;

struct EmitStorage {
  alignas(8) unsigned char staged[kGridWarps][32 * sizeof(SphereContact)];
  unsigned long long shift[kGridThreads];  // index in the output minus index in the tile
  BlockSums::TempStorage sums;
  std::uint32_t neighbors[kSlots * kGridThreads];  // of the rows of the tile, sorted, without gaps
  std::uint8_t owners[kSlots * kGridThreads];      // their rows in the tile
};
struct LongRowStorage {
  std::uint32_t words[kGridWarps * kMaxLongRow];  // neighbors of a row per warp, or a bit set
  std::uint32_t group_counts[kWindowWords / 32];  // neighbors in each 32 words of the bit set
  std::uint32_t before;                           // neighbors below the window
};
static_assert(kGridWarps * kMaxLongRow >= kWindowWords);

__device__ inline unsigned long long contacts_found(const SearchState& state) {
  return state.contacts + state.long_row_contacts;
}
__device__ inline bool is_complete(const GridArgs& args, const SearchOutput& output) {
  const unsigned long long total = contacts_found(*args.state);
  return total <= args.rows.capacity && total <= output.capacity;
}

/// The output of a search whose number of contacts is known.
__device__ inline SearchOutput with_row_length(const GridArgs& args, const SearchOutput& output) {
  SearchOutput known = output;
  known.rows.length = contacts_found(*args.state);
  return known;
}

/// Defers a row that is too long for this phase to a later phase.
__device__ inline void defer_row(const GridArgs& args, std::uint32_t a, std::uint32_t count,
                                 unsigned long long offset) {
  if (count > kMaxLongRow) {
    args.rows.very_long_rows[atomicAdd(&args.state->very_long_rows, 1u)] = a;
  } else {
    args.rows.long_rows[atomicAdd(&args.state->long_rows, 1u)] = a;
  }
  args.rows.offsets[a] = offset;
}
/// defer_row() for a row whose first neighbors are in slots; copies them.
__device__ inline void defer_row_in_slots(const GridArgs& args, std::uint32_t a,
                                          std::uint32_t count, unsigned long long offset) {
  defer_row(args, a, count, offset);
  for (std::uint32_t k = 0; k < kSlots; ++k) {
    args.rows.long_row_neighbors[offset + k] =
        args.scratch.neighbors[std::size_t{args.table.positions[a]} * kSlots + k];
  }
}

__device__ inline void exchange(std::uint32_t& p, std::uint32_t& q) {
  const std::uint32_t low = min(p, q);
  q = max(p, q);
  p = low;
}

/// Sorts eight values by a network of 19 exchanges (Knuth 5.3.4).
__device__ inline void sort_eight(std::uint32_t (&v)[8]) {
  exchange(v[0], v[2]), exchange(v[1], v[3]), exchange(v[4], v[6]), exchange(v[5], v[7]);
  exchange(v[0], v[4]), exchange(v[1], v[5]), exchange(v[2], v[6]), exchange(v[3], v[7]);
  exchange(v[0], v[1]), exchange(v[2], v[3]), exchange(v[4], v[5]), exchange(v[6], v[7]);
  exchange(v[2], v[4]), exchange(v[3], v[5]);
  exchange(v[1], v[4]), exchange(v[3], v[6]);
  exchange(v[1], v[2]), exchange(v[3], v[4]), exchange(v[5], v[6]);
}

/// A thread sorts a row: the first eight neighbors with a network, the rare further ones by
/// insertion.
__device__ inline void sort_neighbors(const std::uint32_t* neighbors, std::uint32_t count,
                                      std::uint32_t* sorted, std::uint8_t* owners) {
  std::uint32_t v[8];
#pragma unroll
  for (unsigned k = 0; k < 8; ++k) v[k] = k < count ? neighbors[k] : ~0u;
  sort_eight(v);
#pragma unroll
  for (unsigned k = 0; k < 8; ++k) {
    if (k < count) sorted[k] = v[k], owners[k] = static_cast<std::uint8_t>(threadIdx.x);
  }
  for (std::uint32_t k = 8; k < count; ++k) {
    const std::uint32_t b = neighbors[k];
    std::uint32_t to = k;
    for (; to > 0 && sorted[to - 1] > b; --to) sorted[to] = sorted[to - 1];
    sorted[to] = b;
    owners[k] = static_cast<std::uint8_t>(threadIdx.x);
  }
}

/// A lane writes a contact to `staged`, the shared memory of its warp for write_staged(), or a pair
/// directly to index `at` of the output.
__device__ inline void write_or_stage(const SearchOutput& output, unsigned long long at,
                                      std::uint32_t a, std::uint32_t b, const SphereInstance& sa,
                                      const SphereInstance& sb, unsigned char* staged) {
  if (output.contacts == nullptr) {
    write_pair(output, at, a, b);
    return;
  }
  const PairResult r = detail::test_sphere_pair(sa, sb);
  reinterpret_cast<SphereContact*>(staged)[lane_id()] = {a, b, r.normal, r.distance};
}

/// A warp copies the contacts of its lanes from `staged` to consecutive indices, so that it writes
/// whole memory sectors.
__device__ inline void write_staged(unsigned char* staged, unsigned count, SphereContact* to) {
  static_assert(sizeof(SphereContact) % 8 == 0);
  constexpr unsigned kWords = sizeof(SphereContact) / 8;
  __syncwarp();
  const auto* const from = reinterpret_cast<const unsigned long long*>(staged);
  auto* const words = reinterpret_cast<unsigned long long*>(to);
#pragma unroll
  for (unsigned k = 0; k < kWords; ++k) {
    const unsigned w = 32 * k + lane_id();
    if (w < count * kWords) words[w] = from[w];
  }
  __syncwarp();
}

/// Stores the row lengths by index instead of by position, and sums those of each block.
__device__ inline void sum_counts(const GridArgs& args, EmitStorage& s) {
  const Span span = span_of_block(args.input.rows(), 1);
  unsigned long long sum = 0;
  for (std::uint64_t a = span.first + threadIdx.x; a < span.past; a += kGridThreads) {
    const std::uint32_t count = args.rows.counts[args.table.positions[a]];
    args.table.ranks[a] = count;
    sum += count;
  }
  sum = block_sum(sum, s.sums);
  if (threadIdx.x == 0) args.rows.sums[blockIdx.x] = sum;
}

/// A block writes the rows of up to kGridThreads consecutive a's, which are consecutive in the
/// output. First each thread sorts a row, then each thread writes a contact.
/// @return the number of contacts of these rows.
__device__ inline unsigned long long emit_tile(const GridArgs& args, const SearchOutput& output,
                                               std::uint64_t first_a, std::uint64_t past_a,
                                               unsigned long long before, EmitStorage& s) {
  __syncthreads();
  const std::uint64_t mine = first_a + threadIdx.x;
  const auto a = static_cast<std::uint32_t>(mine);
  const std::uint32_t count = mine < past_a ? args.table.ranks[mine] : 0;
  const std::uint32_t few = count > kSlots ? 0 : count;
  const std::uint32_t* const neighbors =
      args.scratch.neighbors + (few != 0 ? std::size_t{args.table.positions[mine]} * kSlots : 0);
  // One scan computes two sums: of the slots in use (low bits, at most kSlots * kGridThreads), and
  // of all contacts.
  constexpr unsigned kFewBits = 16;
  unsigned long long total = 0;
  const unsigned long long sums =
      block_exclusive_sum(static_cast<unsigned long long>(count) << kFewBits | few, s.sums, total);
  const auto start = static_cast<std::uint32_t>(sums & ((1u << kFewBits) - 1));
  const auto fews = static_cast<std::uint32_t>(total & ((1u << kFewBits) - 1));
  const unsigned long long offset = before + (sums >> kFewBits);
  sort_neighbors(neighbors, few, s.neighbors + start, s.owners + start);
  s.shift[threadIdx.x] = offset - start;
  if (count > kSlots) defer_row_in_slots(args, a, count, offset);
  __syncthreads();
  // Without long rows, the contacts of the tile are consecutive in the output.
  const bool stages = fews == total >> kFewBits && output.contacts != nullptr;
  for (std::uint32_t first = threadIdx.x & ~31u; first < fews; first += kGridThreads) {
    const std::uint32_t c = first + lane_id();
    unsigned char* const staged = s.staged[threadIdx.x / 32];
    if (c < fews) {
      const unsigned owner = s.owners[c];
      const std::uint32_t of = static_cast<std::uint32_t>(first_a) + owner, b = s.neighbors[c];
      if (stages) {
        const PairResult r =
            detail::test_sphere_pair(load_sphere(args.input, of), load_sphere(args.input, b));
        reinterpret_cast<SphereContact*>(staged)[lane_id()] = {of, b, r.normal, r.distance};
      } else {
        write_contact(output, s.shift[owner] + c, of, b, load_sphere(args.input, of),
                      load_sphere(args.input, b));
      }
    }
    if (stages) write_staged(staged, min(32u, fews - first), output.contacts + before + first);
  }
  return total >> kFewBits;
}

__device__ inline void emit(const GridArgs& args, const SearchOutput& output, EmitStorage& s) {
  const Span span = span_of_block(args.input.rows(), 1);
  unsigned long long before = sum_of_blocks_before(args.rows.sums, s.sums);
  for (std::uint64_t a = span.first; a < span.past; a += kGridThreads) {
    before += emit_tile(args, output, a, span.past, before, s);
  }
}

/// Appends the overflow pairs of each long row to those that were in slots.
__device__ inline void place_overflow(const GridArgs& args) {
  const std::uint64_t stride = std::uint64_t{gridDim.x} * kGridThreads;
  for (std::uint64_t k = std::uint64_t{blockIdx.x} * kGridThreads + threadIdx.x;
       k < args.state->overflow; k += stride) {
    const OverflowPair pair = args.rows.overflow[k];
    args.rows.long_row_neighbors[args.rows.offsets[pair.a] + pair.rank] = pair.b;
  }
}

/// A warp sorts `length` ids by Batcher's bitonic network. The array has room for the next power of
/// two.
__device__ inline void sort_ids(std::uint32_t* ids, std::uint32_t length) {
  std::uint32_t padded = 32;
  while (padded < length) padded *= 2;
  for (unsigned i = length + lane_id(); i < padded; i += 32) ids[i] = ~0u;
  for (unsigned run = 2; run <= padded; run *= 2) {
    for (unsigned distance = run / 2; distance != 0; distance /= 2) {
      __syncwarp();
      for (unsigned k = lane_id(); k < padded / 2; k += 32) {
        const unsigned i = 2 * k - k % distance, j = i + distance;
        const std::uint32_t low = min(ids[i], ids[j]), high = max(ids[i], ids[j]);
        const bool ascending = (i & run) == 0;
        ids[i] = ascending ? low : high;
        ids[j] = ascending ? high : low;
      }
    }
  }
  __syncwarp();
}

/// Writes the contact of a long row to index `at` of the output, and its shift, if the search
/// writes them.
template <bool kPeriodic>
__device__ void write_of_long_row(const GridArgs& args, const SearchOutput& output,
                                  unsigned long long at, std::uint32_t a, std::uint32_t b,
                                  const SphereInstance& sphere) {
  write_contact(output, at, a, b, sphere, load_sphere(args.input, b));
  if constexpr (kPeriodic) {
    const PeriodicSpheres& known = *args.input.periodic.known;
    if (!known.shifts_are_written) return;
    const CellPoint* const points = output.rows.points;
    const ImageShift shift =
        shift_of_points(load_point(points + a), load_point(points + b), known.cell);
    for (std::size_t k = 0; k < 3; ++k) output.rows.shifts[3 * at + k] = shift[k];
  }
}

/// A warp writes a row of up to kMaxLongRow contacts in order. A short row is written by rank
/// (number of smaller neighbors) instead of sorting.
template <bool kPeriodic>
__device__ void emit_long_row(const GridArgs& args, const SearchOutput& output, std::uint32_t a,
                              std::uint32_t* ids) {
  constexpr std::uint32_t kFew = 64;
  const unsigned long long offset = args.rows.offsets[a];
  const std::uint32_t length = args.table.ranks[a];
  for (unsigned i = lane_id(); i < length; i += 32)
    ids[i] = args.rows.long_row_neighbors[offset + i];
  const bool few = length <= kFew;
  if (!few) sort_ids(ids, length);
  __syncwarp();
  const SphereInstance sphere = load_sphere(args.input, a);
  for (unsigned i = lane_id(); i < length; i += 32) {
    const std::uint32_t b = ids[i];
    std::uint32_t rank = i;
    if (few) {
      rank = 0;
      for (unsigned k = 0; k < length; ++k) rank += ids[k] < b ? 1 : 0;
    }
    write_of_long_row<kPeriodic>(args, output, offset + rank, a, b, sphere);
  }
  __syncwarp();
}

/// Writes the contacts of a very long row whose neighbors are in [window, window + kWindow), in
/// order: the neighbors become bits of a set. Windows are independent, so that a row with a million
/// neighbors is distributed over many blocks.
template <bool kPeriodic>
__device__ void emit_window(const GridArgs& args, const SearchOutput& output, std::uint32_t a,
                            unsigned long long offset, std::uint32_t length, std::uint32_t window,
                            LongRowStorage& s) {
  for (unsigned w = threadIdx.x; w < kWindowWords; w += kGridThreads) s.words[w] = 0;
  if (threadIdx.x == 0) s.before = 0;
  __syncthreads();
  std::uint32_t smaller = 0;
  constexpr unsigned kAtOnce = 16;  // loads in flight: a row can have n - 1 neighbors
  for (std::uint32_t first = threadIdx.x; first < length; first += kAtOnce * kGridThreads) {
    std::uint32_t b[kAtOnce];
    for (unsigned k = 0; k < kAtOnce; ++k) {
      const std::uint64_t i = first + std::uint64_t{k} * kGridThreads;
      b[k] = i < length ? args.rows.long_row_neighbors[offset + i] : ~0u;
    }
    for (unsigned k = 0; k < kAtOnce; ++k) {
      smaller += b[k] < window ? 1 : 0;
      if (b[k] >= window && b[k] - window < kWindow && b[k] != ~0u) {
        atomicOr(&s.words[(b[k] - window) / 32], 1u << b[k] % 32);
      }
    }
  }
  smaller = warp_sum(smaller);
  if (lane_id() == 0) atomicAdd(&s.before, smaller);
  __syncthreads();
  for (unsigned g = threadIdx.x / 32; g < kWindowWords / 32; g += kGridWarps) {
    const auto count = static_cast<unsigned>(__popc(s.words[32 * g + lane_id()]));
    s.group_counts[g] = warp_sum(count);
  }
  __syncthreads();
  const SphereInstance sphere = load_sphere(args.input, a);
  for (unsigned g = threadIdx.x / 32; g < kWindowWords / 32; g += kGridWarps) {
    unsigned long long at = offset + s.before;
    for (unsigned k = 0; k < g; ++k) at += s.group_counts[k];
    emit_row(at, window / 32 + 32 * g, s.words[32 * g + lane_id()],
             [&](unsigned long long to, std::uint32_t b) {
               write_of_long_row<kPeriodic>(args, output, to, a, b, sphere);
             });
  }
}

/// First each warp writes a long row, then each block a window of a very long row.
template <bool kPeriodic>
__device__ void emit_long_rows(const GridArgs& args, const SearchOutput& output,
                               LongRowStorage& s) {
  const unsigned warp = threadIdx.x / 32;
  for (std::uint32_t i = blockIdx.x * kGridWarps + warp; i < args.state->long_rows;
       i += gridDim.x * kGridWarps) {
    emit_long_row<kPeriodic>(args, output, args.rows.long_rows[i], s.words + warp * kMaxLongRow);
  }
  const std::uint32_t windows = (args.input.n - 1) / kWindow + 1;
  const unsigned long long items = std::uint64_t{args.state->very_long_rows} * windows;
  for (unsigned long long item = blockIdx.x; item < items; item += gridDim.x) {
    __syncthreads();
    const std::uint32_t a = args.rows.very_long_rows[item / windows];
    emit_window<kPeriodic>(args, output, a, args.rows.offsets[a], args.table.ranks[a],
                           static_cast<std::uint32_t>(item % windows) * kWindow, s);
  }
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
