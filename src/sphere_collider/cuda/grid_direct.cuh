/// Grid search without sorting, for about 10^4 spheres of similar radius: each cell of a single
/// grid has slots for a few spheres. It needs four grid barriers fewer than the sorted search.
#pragma once

#include "src/sphere_collider/cuda/grid_build.cuh"
#include "src/sphere_collider/cuda/grid_emit.cuh"
#include "src/sphere_collider/cuda/sphere_filter.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

inline constexpr unsigned kLanesOfSphere = 9;  // one per row of cells around a sphere
inline constexpr unsigned kSpheresOfWarp = 32 / kLanesOfSphere;
inline constexpr std::uint32_t kMinCellSlots = 6, kMaxCellSlots = 32;  // slots of a cell
inline constexpr std::uint32_t kDirectPairs = 1024;   // largest number of pairs of a block
inline constexpr std::uint32_t kDirectDoubtful = 64;  // the same of pairs that need an exact test

/// Grid of the cells between the lowest and the highest coordinates.
struct DirectPlan {
  Real half, inverse;
  std::int32_t x0, y0, z0;
  std::int32_t nx, ny, nz;
  std::uint32_t cell_slots;  ///< slots of a cell; 0: the direct search does not apply
};

struct DirectStorage {
  alignas(8) unsigned char staged[kGridWarps][32 * sizeof(SphereContact)];
  BlockSums::TempStorage sums;
  std::uint32_t found, doubtful;
  std::uint32_t doubtful_rows[kDirectDoubtful], doubtful_slots[kDirectDoubtful];
  std::uint32_t counts[kGridThreads], starts[kGridThreads];  // row lengths and their exclusive sums
  std::uint32_t neighbors[kDirectPairs];                     // in the order of discovery
  std::uint32_t ranks[kDirectPairs];    // rank in the row, and (low 8 bits) the row in the block
  std::uint32_t grouped[kDirectPairs];  // neighbors by row
  std::uint32_t sorted[kDirectPairs];   // neighbors by row, sorted
  std::uint8_t owners[kDirectPairs];    // rows of the sorted neighbors
};
static_assert(kGridThreads <= 256);

__device__ inline DirectPlan make_direct_plan(const GridArgs& args) {
  const SearchState& state = *args.state;
  DirectPlan plan{};
  if (args.scratch.slots == nullptr || args.input.n > gridDim.x * kGridThreads ||
      state.has_far != 0 || last_level(state, args.input.n) != 0) {
    return plan;
  }
  plan.half = half_0_of(args.state);
  plan.inverse = inverse_width(plan.half);
  const auto first = [&](int axis) {
    return cell_of(-from_ordered(state.farthest[2 * axis + 1]), plan.inverse);
  };
  const auto count = [&](int axis, std::int32_t from) {
    return std::int64_t{cell_of(from_ordered(state.farthest[2 * axis]), plan.inverse)} - from + 1;
  };
  plan.x0 = first(0), plan.y0 = first(1), plan.z0 = first(2);
  const std::int64_t nx = count(0, plan.x0), ny = count(1, plan.y0), nz = count(2, plan.z0);
  const double cells = static_cast<double>(nx) * static_cast<double>(ny) * static_cast<double>(nz);
  const double cell_slots = static_cast<double>(args.input.n) * kDirectSlots / cells;
  if (cell_slots < kMinCellSlots) return plan;
  // The first spheres have pairs with all of their neighbors: about 4.19 times the spheres of a
  // cell, or fewer in a thin layer. Cells at the boundary have fewer spheres.
  const double longest_rows = 4.19 * static_cast<double>(args.input.n) / cells *
                              static_cast<double>(args.input.rows()) / gridDim.x;
  if (longest_rows > kDirectFill * kDirectPairs) return plan;
  plan.nx = static_cast<std::int32_t>(nx);
  plan.ny = static_cast<std::int32_t>(ny);
  plan.nz = static_cast<std::int32_t>(nz);
  plan.cell_slots =
      cell_slots < kMaxCellSlots ? static_cast<std::uint32_t>(cell_slots) : kMaxCellSlots;
  return plan;
}

/// Inserts spheres into the slots of their cells.
__device__ inline void insert(const GridArgs& args, const DirectPlan& plan) {
  for (std::uint64_t i = grid_thread(); i < args.input.n; i += all_threads()) {
    const SphereInstance sphere = load_sphere(args.input, i);
    const std::int32_t x = cell_of(sphere.centre.x, plan.inverse) - plan.x0;
    const std::int32_t y = cell_of(sphere.centre.y, plan.inverse) - plan.y0;
    const std::int32_t z = cell_of(sphere.centre.z, plan.inverse) - plan.z0;
    const auto cell = static_cast<std::uint32_t>((z * plan.ny + y) * plan.nx + x);
    const std::uint32_t at = atomicAdd(&args.table.starts[cell], 1u);
    if (at < plan.cell_slots) {
      const std::size_t slot = std::size_t{cell} * plan.cell_slots + at;
      args.scratch.slots[slot] = sphere;
      args.scratch.slot_ids[slot] = id_of(args.input, i);
    } else {
      args.state->cell_is_full = 1;
    }
  }
}

__device__ inline void add_neighbor(unsigned local, std::uint32_t b, DirectStorage& s) {
  const std::uint32_t rank = atomicAdd(&s.counts[local], 1u);
  const std::uint32_t at = atomicAdd(&s.found, 1u);
  if (at < kDirectPairs) s.neighbors[at] = b, s.ranks[at] = rank << 8 | local;
}

/// A lane tests its share of the rows of cells around sphere `a`, which has index `local` in the
/// block, for neighbors b > a.
template <bool kPeriodic>
__device__ void search_directly(const GridArgs& args, const DirectPlan& plan, std::uint32_t a,
                                unsigned local, unsigned lane, DirectStorage& s) {
  constexpr std::int32_t kCellsAtOnce = 3;
  constexpr unsigned kAtOnce = 4;
  [[maybe_unused]] const Real doubt =
      doubt_of<kPeriodic>(args.input.periodic, error_bound_of(2 * plan.half), 2 * plan.half);
  const SphereInstance self = load_sphere(args.input, a);
  const Real search_radius = search_radius_of(self.radius, plan.half);
  const auto low = [&](Real x, std::int32_t first) {
    return max(cell_of(moved(x, -search_radius), plan.inverse) - first, 0);
  };
  const auto high = [&](Real x, std::int32_t first, std::int32_t count) {
    return min(cell_of(moved(x, search_radius), plan.inverse) - first, count - 1);
  };
  const std::int32_t x0 = low(self.centre.x, plan.x0), x1 = high(self.centre.x, plan.x0, plan.nx);
  const std::int32_t y0 = low(self.centre.y, plan.y0), y1 = high(self.centre.y, plan.y0, plan.ny);
  const std::int32_t z0 = low(self.centre.z, plan.z0), z1 = high(self.centre.z, plan.z0, plan.nz);
  const std::int32_t rows_y = y1 - y0 + 1, rows = rows_y * (z1 - z0 + 1);
  for (auto row = static_cast<std::int32_t>(lane); row < rows; row += kLanesOfSphere) {
    const std::int32_t z = row / rows_y;
    const auto cells =
        static_cast<std::uint32_t>(((z0 + z) * plan.ny + y0 + row - z * rows_y) * plan.nx);
    for (std::int32_t x = x0; x <= x1; x += kCellsAtOnce) {
      const std::uint32_t cell = cells + static_cast<std::uint32_t>(x);
      std::uint32_t ends[kCellsAtOnce];
#pragma unroll
      for (std::int32_t k = 0; k < kCellsAtOnce; ++k) {
        ends[k] = x + k <= x1 ? args.table.starts[cell + static_cast<std::uint32_t>(k)] : 0;
      }
      ends[1] += ends[0], ends[2] += ends[1];
      // Candidates are numbered across the cells; free slots at the end of a cell are skipped.
      const auto slot_of = [&](std::uint32_t i) {
        const std::uint32_t skipped = i < ends[0]   ? 0
                                      : i < ends[1] ? plan.cell_slots - ends[0]
                                                    : 2 * plan.cell_slots - ends[1];
        return std::size_t{cell} * plan.cell_slots + i + skipped;
      };
      for (std::uint32_t first = 0; first < ends[2]; first += kAtOnce) {
        SphereInstance others[kAtOnce];
#pragma unroll
        for (unsigned k = 0; k < kAtOnce; ++k) {
          others[k] = load_sorted(args.scratch.slots + slot_of(min(first + k, ends[2] - 1)));
        }
#pragma unroll
        for (unsigned k = 0; k < kAtOnce; ++k) {
          if (first + k >= ends[2] || !touch(self, others[k])) continue;
          const std::uint32_t b =
              index_of<kPeriodic>(args.input, args.scratch.slot_ids[slot_of(first + k)]);
          if (b <= a) continue;
          if (kPeriodic && !(excess(self, others[k]) < -doubt)) {
            const std::uint32_t at = atomicAdd(&s.doubtful, 1u);
            if (at >= kDirectDoubtful) continue;
            s.doubtful_rows[at] = local;
            s.doubtful_slots[at] = static_cast<std::uint32_t>(slot_of(first + k));
          } else {
            add_neighbor(local, b, s);
          }
        }
      }
    }
  }
}

/// Tests the pairs that search_directly() could not decide from reduced spheres and images.
/// @param first_a sphere of the first row of the block
__device__ inline void test_doubtful(const GridArgs& args, std::uint32_t first_a,
                                     DirectStorage& s) {
  for (unsigned k = threadIdx.x; k < min(s.doubtful, kDirectDoubtful); k += kGridThreads) {
    const std::uint32_t local = s.doubtful_rows[k], slot = s.doubtful_slots[k], a = first_a + local,
                        b = index_of<true>(args.input, args.scratch.slot_ids[slot]);
    if (touch_exactly<true>(args.input, a, load_sphere(args.input, a), b,
                            load_sorted(args.scratch.slots + slot))) {
      add_neighbor(local, b, s);
    }
  }
  if (threadIdx.x == 0 && s.doubtful > kDirectDoubtful) args.state->block_is_full = 1;
  __syncthreads();
}

/// Finds and sorts the pairs (a, b) of the spheres a of the block, and writes their number to
/// Table::sums.
template <bool kPeriodic>
__device__ void find_directly(const GridArgs& args, const DirectPlan& plan, DirectStorage& s) {
  __syncthreads();
  s.counts[threadIdx.x] = 0;
  if (threadIdx.x == 0) s.found = s.doubtful = 0;
  __syncthreads();
  const Span span = span_of_block(args.input.rows(), 1);
  const unsigned group = lane_id() / kLanesOfSphere;
  if (group < kSpheresOfWarp) {
    for (std::uint64_t a = span.first + threadIdx.x / 32 * kSpheresOfWarp + group; a < span.past;
         a += kGridWarps * kSpheresOfWarp) {
      search_directly<kPeriodic>(args, plan, static_cast<std::uint32_t>(a),
                                 static_cast<unsigned>(a - span.first), lane_id() % kLanesOfSphere,
                                 s);
    }
  }
  __syncthreads();
  if constexpr (kPeriodic) test_doubtful(args, static_cast<std::uint32_t>(span.first), s);
  unsigned long long total = 0;
  s.starts[threadIdx.x] =
      static_cast<std::uint32_t>(block_exclusive_sum(s.counts[threadIdx.x], s.sums, total));
  if (threadIdx.x == 0) {
    args.table.sums[blockIdx.x] = total;
    if (total > kDirectPairs) args.state->block_is_full = 1;
  }
  if (total > kDirectPairs) return;
  __syncthreads();
  for (std::uint32_t k = threadIdx.x; k < total; k += kGridThreads) {
    s.grouped[s.starts[s.ranks[k] & 255u] + (s.ranks[k] >> 8)] = s.neighbors[k];
  }
  __syncthreads();
  for (std::uint32_t k = threadIdx.x; k < total; k += kGridThreads) {
    const unsigned owner = s.ranks[k] & 255u;
    const std::uint32_t start = s.starts[owner], b = s.neighbors[k];
    std::uint32_t at = start;
    for (std::uint32_t other = 0; other < s.counts[owner]; ++other) {
      at += s.grouped[start + other] < b ? 1 : 0;
    }
    s.sorted[at] = b;
    s.owners[at] = static_cast<std::uint8_t>(owner);
  }
}

/// Writes the pairs that find_directly() left in shared memory to the output.
__device__ inline void emit_directly(const GridArgs& args, const SearchOutput& output,
                                     DirectStorage& s) {
  unsigned long long sums = 0;  // over all blocks, and (low 32 bits) over lower blocks
  for (unsigned k = threadIdx.x; k < gridDim.x; k += kGridThreads) {
    const unsigned long long sum = args.table.sums[k];
    sums += sum << 32 | (k < blockIdx.x ? sum : 0);
  }
  // The low half cannot overflow: there are at most as many blocks as spheres.
  static_assert(std::uint64_t{kMaxDirect} * kDirectPairs < (1ull << 32));
  sums = block_sum(sums, s.sums);
  const unsigned long long all = sums >> 32, before = sums & 0xffffffffull;
  const bool complete = all <= output.capacity;
  if (blockIdx.x == 0 && threadIdx.x == 0) write_count(output, all, kNoSphere, complete);
  if (!complete) return;
  SearchOutput known = output;
  known.rows.length = all;
  const auto total = static_cast<std::uint32_t>(args.table.sums[blockIdx.x]);
  const auto first_a = static_cast<std::uint32_t>(span_of_block(args.input.rows(), 1).first);
  for (std::uint32_t first = threadIdx.x & ~31u; first < total; first += kGridThreads) {
    const std::uint32_t c = first + lane_id();
    if (c < total) {
      const std::uint32_t a = first_a + s.owners[c], b = s.sorted[c];
      write_or_stage(known, before + c, a, b, load_sphere(args.input, a),
                     load_sphere(args.input, b), s.staged[threadIdx.x / 32]);
    }
    if (output.contacts != nullptr) {
      write_staged(s.staged[threadIdx.x / 32], min(32u, total - first),
                   output.contacts + before + first);
    }
  }
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
