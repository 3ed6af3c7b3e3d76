/// First phases of the grid search. For any number of launches: validation and bounds of the
/// spheres, and a sample of the cells. For one launch: the counting sort by cell.
#pragma once

#include "src/sphere_collider/cuda/grid.cuh"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Number of items that a thread processes at a time, so that their memory accesses overlap.
inline constexpr unsigned kBatch = 4;

struct BuildStorage {
  BlockSums::TempStorage sums;
  Real extremes[8][kGridWarps];
  bool any[kGridWarps];
  std::uint32_t samples[2 * kSamples];
};

__device__ inline std::uint64_t grid_thread() {
  return std::uint64_t{blockIdx.x} * kGridThreads + threadIdx.x;
}
__device__ inline std::uint64_t all_threads() { return std::uint64_t{gridDim.x} * kGridThreads; }

/// Returns true in the last block of the calling kernel, in which all earlier writes of other
/// blocks are visible. `blocks_passed` must be 0 initially. Call from all threads of the block.
__device__ inline bool is_last_block(std::uint32_t& blocks_passed) {
  __shared__ bool last;
  __threadfence();
  __syncthreads();
  if (threadIdx.x == 0) last = atomicAdd(&blocks_passed, 1u) == gridDim.x - 1;
  __syncthreads();
  __threadfence();
  return last;
}

/// Clears `bytes` bytes and up to 15 following bytes.
__device__ inline void clear(void* data, std::size_t bytes) {
  uint4* const to = static_cast<uint4*>(data);
  const std::size_t count = (bytes + sizeof(uint4) - 1) / sizeof(uint4);
  for (std::size_t i = grid_thread(); i < count; i += all_threads()) to[i] = {0, 0, 0, 0};
}

__device__ inline void clear_table(const GridArgs& args) {
  clear(args.table.starts, (std::size_t{args.table.size} + 1) * sizeof(*args.table.starts));
}
__device__ inline void clear_counts(const GridArgs& args) {
  clear(args.rows.counts, args.input.n * sizeof(*args.rows.counts));
}

/// Validates the spheres, and computes the largest and the smallest half cell width that a radius
/// requires and the bounds of all centres.
__device__ inline void measure(const GridArgs& args, BuildStorage& s) {
  constexpr Real kNone = -std::numeric_limits<Real>::max();
  // Maximum of: half cell width, minus half cell width, x, -x, y, -y, z, -z.
  Real extremes[8] = {kNone, kNone, kNone, kNone, kNone, kNone, kNone, kNone};
  bool any = false, far = false;
  for (std::uint64_t first = grid_thread(); first < args.input.n; first += kBatch * all_threads()) {
    SphereInstance spheres[kBatch];
#pragma unroll
    for (unsigned k = 0; k < kBatch; ++k) {
      const std::uint64_t i = first + k * all_threads();
      spheres[k] = load_sphere(args.input, i < args.input.n ? i : first);
    }
#pragma unroll
    for (unsigned k = 0; k < kBatch; ++k) {
      const SphereInstance& sphere = spheres[k];
      if (!is_valid(sphere)) {
        const std::uint64_t i = first + k * all_threads();
        report_invalid(args.state, static_cast<std::uint32_t>(i < args.input.n ? i : first));
        continue;
      }
      const Real half = half_cell_for_radius(sphere.radius);
      const Vec3& c = sphere.centre;
      const Real values[8] = {half, -half, c.x, -c.x, c.y, -c.y, c.z, -c.z};
#pragma unroll
      for (unsigned v = 0; v < 8; ++v)
        extremes[v] = extremes[v] > values[v] ? extremes[v] : values[v];
      any = true;
      far = far || is_far(sphere);
    }
  }
#pragma unroll
  for (unsigned v = 0; v < 8; ++v) extremes[v] = warp_max(extremes[v]);
  const bool any_of_warp = __any_sync(kFullWarp, any);
  if (__any_sync(kFullWarp, far) && lane_id() == 0) args.state->has_far = 1;
  if (lane_id() == 0) {
#pragma unroll
    for (unsigned v = 0; v < 8; ++v) s.extremes[v][threadIdx.x / 32] = extremes[v];
    s.any[threadIdx.x / 32] = any_of_warp;
  }
  __syncthreads();
  static_assert(kGridWarps == 8, "a warp reduces one of the eight extremes");
  const unsigned value = threadIdx.x / 32;
  const Real extreme = warp_max(s.extremes[value][lane_id() % kGridWarps]);
  const bool any_of_block = __any_sync(kFullWarp, s.any[lane_id() % kGridWarps]);
  if (!any_of_block || lane_id() != 0) return;
  SearchState& state = *args.state;
  if (value == 0) {
    atomicMax(&state.largest_half, bits_of(extreme));
  } else if (value == 1) {
    atomicMax(&state.smallest_half, ~bits_of(-extreme));
  } else {
    atomicMax(&state.farthest[value - 2], ordered(extreme));
  }
}

/// Whether radii differ enough for more than one level.
__device__ inline bool needs_sample(const SearchState& state) {
  const Real smallest = std::bit_cast<Real>(static_cast<RealBits>(~state.smallest_half));
  return level_for(smallest, {half_0_of(&state)}) > 0;
}

/// Counts, for each level but the finest, the pairs of sampled spheres that would share a cell if
/// that level were the last one. A block counts one level at a time, in a hash table. A slot holds
/// 19 bits of the hash of a cell and, in the low 13 bits, its number of spheres.
__device__ inline void sample_cells(const GridArgs& args, BuildStorage& s) {
  const GridScale all_levels{half_0_of(args.state)};
  const Real smallest = std::bit_cast<Real>(static_cast<RealBits>(~args.state->smallest_half));
  const int finest = level_for(smallest, all_levels);
  const std::uint32_t samples = min(args.input.n, kSamples);
  constexpr std::uint32_t kSlotMask = 2 * kSamples - 1;
  for (int level = static_cast<int>(blockIdx.x); level < finest;
       level += static_cast<int>(gridDim.x)) {
    __syncthreads();
    for (unsigned i = threadIdx.x; i < 2 * kSamples; i += blockDim.x) s.samples[i] = 0;
    __syncthreads();
    const Real inverse = inverse_width(half_cell_of(all_levels.half_0, level));
    std::uint32_t pairs = 0;
    for (std::uint32_t k = threadIdx.x; k < samples; k += blockDim.x) {
      // Multiples of the golden ratio modulo 1 are evenly distributed over any order of the
      // spheres.
      const std::uint32_t sample = k * 0x9e3779b9u;
      const std::uint32_t i = args.input.n > samples ? __umulhi(sample, args.input.n) : k;
      const SphereInstance sphere = load_sphere(args.input, i);
      if (level_of(sphere, all_levels) < level) continue;
      const std::uint32_t hash =
          row_of(cell_of(sphere.centre.y, inverse), cell_of(sphere.centre.z, inverse),
                 static_cast<int>(row_of(cell_of(sphere.centre.x, inverse), 0, level)));
      const std::uint32_t tag = hash & ~kSlotMask;
      for (std::uint32_t slot = hash & kSlotMask;; slot = (slot + 1) & kSlotMask) {
        const std::uint32_t found = atomicCAS(&s.samples[slot], 0, tag | 1);
        if (found == 0) break;
        if ((found & ~kSlotMask) != tag) continue;
        pairs += atomicAdd(&s.samples[slot], 1u) & kSlotMask;
        break;
      }
    }
    pairs = warp_sum(pairs);
    if (lane_id() == 0) atomicAdd(&args.state->same_cell[level], pairs);
  }
}

/// Computes the bucket of each sphere and its rank there, and the histogram of the buckets.
__device__ inline void assign(const GridArgs& args, const GridPlan& plan) {
  unsigned level_bits = 0;
  for (std::uint64_t first = grid_thread(); first < args.input.n; first += kBatch * all_threads()) {
    std::uint32_t buckets[kBatch], ranks[kBatch];
#pragma unroll
    for (unsigned k = 0; k < kBatch; ++k) {
      const std::uint64_t i = first + k * all_threads();
      const SphereInstance sphere = load_sphere(args.input, i < args.input.n ? i : first);
      buckets[k] = plan.bucket_of(sphere);
      if (!plan.single && !is_far(sphere)) level_bits |= 1u << level_of(sphere, plan.scale);
    }
#pragma unroll
    for (unsigned k = 0; k < kBatch; ++k) {
      if (first + k * all_threads() < args.input.n)
        ranks[k] = atomicAdd(&args.table.starts[buckets[k]], 1u);
    }
#pragma unroll
    for (unsigned k = 0; k < kBatch; ++k) {
      const std::uint64_t i = first + k * all_threads();
      if (i < args.input.n) args.table.positions[i] = buckets[k], args.table.ranks[i] = ranks[k];
    }
  }
  const unsigned levels = warp_reduce(level_bits, [](unsigned p, unsigned q) { return p | q; });
  if (lane_id() == 0 && levels != 0) atomicOr(&args.state->levels, levels);
}

/// First half of the scan of the table: sums the counts of the buckets of each block.
__device__ inline void sum_table(const GridArgs& args, const GridPlan& plan, BuildStorage& s) {
  const Span span = span_of_block(plan.buckets, 4);
  unsigned long long sum = 0;
  for (std::uint64_t i = span.first + 4 * threadIdx.x; i < span.past; i += 4 * kGridThreads) {
    const uint4 v = *reinterpret_cast<const uint4*>(args.table.starts + i);
    sum += v.x + v.y + v.z + v.w;
  }
  sum = block_sum(sum, s.sums);
  if (threadIdx.x == 0) args.table.sums[blockIdx.x] = sum;
}

/// Second half: replaces the histogram of the buckets by their starts, followed by n.
__device__ inline void scan_table(const GridArgs& args, const GridPlan& plan, BuildStorage& s) {
  unsigned long long before = sum_of_blocks_before(args.table.sums, s.sums);
  if (blockIdx.x == 0 && threadIdx.x == 0) args.table.starts[plan.buckets] = args.input.n;
  const Span span = span_of_block(plan.buckets, 4);
  for (std::uint64_t first = span.first; first < span.past; first += 4 * kGridThreads) {
    const std::uint64_t i = first + 4 * threadIdx.x;
    uint4 v{0, 0, 0, 0};
    if (i < span.past) v = *reinterpret_cast<const uint4*>(args.table.starts + i);
    __syncthreads();
    unsigned long long total = 0;
    const auto start = static_cast<std::uint32_t>(
        before + block_exclusive_sum(v.x + v.y + v.z + v.w, s.sums, total));
    before += total;
    const uint4 starts{start, start + v.x, start + v.x + v.y, start + v.x + v.y + v.z};
    if (i + 4 <= span.past) {
      *reinterpret_cast<uint4*>(args.table.starts + i) = starts;
    } else if (i < span.past) {  // another thread writes the entry after the last bucket
      args.table.starts[i] = starts.x;
      if (i + 1 < span.past) args.table.starts[i + 1] = starts.y;
      if (i + 2 < span.past) args.table.starts[i + 2] = starts.z;
    }
  }
}

/// Sorts the spheres by bucket. Table::positions changes from buckets to positions.
__device__ inline void scatter(const GridArgs& args) {
  for (std::uint64_t first = grid_thread(); first < args.input.n; first += kBatch * all_threads()) {
    std::uint32_t to[kBatch];
#pragma unroll
    for (unsigned k = 0; k < kBatch; ++k) {
      const std::uint64_t i = first + k * all_threads();
      const std::uint64_t from = i < args.input.n ? i : first;
      to[k] = args.table.starts[args.table.positions[from]] + args.table.ranks[from];
    }
#pragma unroll
    for (unsigned k = 0; k < kBatch; ++k) {
      const std::uint64_t i = first + k * all_threads();
      if (i >= args.input.n) break;
      args.table.positions[i] = to[k];
      args.table.ids[to[k]] = id_of(args.input, i);
      args.table.sorted[to[k]] = load_sphere(args.input, i);
    }
  }
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
