/// The first phases of the large-N search: spheres sorted by cell, by counting.
#pragma once

#include "src/sphere_collider/cuda/grid.cuh"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Items that a thread works on at a time, so that their memory accesses overlap.
inline constexpr unsigned kBatch = 4;

struct BuildStorage {
  unsigned long long warp_sums[kGridWarps];
  Real extremes[8][kGridWarps];
  bool any[kGridWarps];
  std::uint32_t samples[2 * kSamples];
};

__device__ inline std::uint64_t grid_thread() {
  return std::uint64_t{blockIdx.x} * kGridThreads + threadIdx.x;
}
__device__ inline std::uint64_t all_threads() { return std::uint64_t{gridDim.x} * kGridThreads; }

/// Whether all other blocks have passed here; then what they wrote before can be read. All threads
/// of a block.
__device__ inline bool is_last_block(std::uint32_t& blocks_passed) {
  __shared__ bool last;
  __threadfence();
  __syncthreads();
  if (threadIdx.x == 0) last = atomicAdd(&blocks_passed, 1u) == gridDim.x - 1;
  __syncthreads();
  __threadfence();
  return last;
}

/// Clears `bytes` bytes and up to 15 more.
__device__ inline void clear(void* data, std::size_t bytes) {
  uint4* const to = static_cast<uint4*>(data);
  const std::size_t count = (bytes + sizeof(uint4) - 1) / sizeof(uint4);
  for (std::size_t i = grid_thread(); i < count; i += all_threads()) to[i] = {0, 0, 0, 0};
}

__device__ inline void clear_table(const GridArgs& args) {
  clear(args.table, (std::size_t{args.table_size} + 1) * sizeof(*args.table));
}
__device__ inline void clear_counts(const GridArgs& args) {
  clear(args.counts, args.n * sizeof(*args.counts));
}

/// Validates; finds the widest and the narrowest cell that a radius asks for, and the box of all
/// centres.
__device__ inline void measure(const GridArgs& args, BuildStorage& s) {
  constexpr Real kNone = -std::numeric_limits<Real>::max();
  // Largest of: half cell, minus half cell, x, -x, y, -y, z, -z.
  Real most[8] = {kNone, kNone, kNone, kNone, kNone, kNone, kNone, kNone};
  bool any = false, far = false;
  for (std::uint64_t first = grid_thread(); first < args.n; first += kBatch * all_threads()) {
    SphereInstance spheres[kBatch];
#pragma unroll
    for (unsigned k = 0; k < kBatch; ++k) {
      const std::uint64_t i = first + k * all_threads();
      spheres[k] = load_sphere(args.spheres + (i < args.n ? i : first));
    }
#pragma unroll
    for (unsigned k = 0; k < kBatch; ++k) {
      const SphereInstance& sphere = spheres[k];
      if (!is_valid(sphere)) {
        const std::uint64_t i = first + k * all_threads();
        report_invalid(args.state, static_cast<std::uint32_t>(i < args.n ? i : first));
        continue;
      }
      const Real half = half_cell_for_radius(sphere.radius);
      const Vec3& c = sphere.centre;
      const Real values[8] = {half, -half, c.x, -c.x, c.y, -c.y, c.z, -c.z};
#pragma unroll
      for (unsigned v = 0; v < 8; ++v) most[v] = most[v] > values[v] ? most[v] : values[v];
      any = true;
      far = far || is_far(sphere);
    }
  }
#pragma unroll
  for (unsigned v = 0; v < 8; ++v) most[v] = warp_max(most[v]);
  const bool any_of_warp = __any_sync(kFullWarp, any);
  if (__any_sync(kFullWarp, far) && lane_id() == 0) args.state->has_far = 1;
  if (lane_id() == 0) {
#pragma unroll
    for (unsigned v = 0; v < 8; ++v) s.extremes[v][threadIdx.x / 32] = most[v];
    s.any[threadIdx.x / 32] = any_of_warp;
  }
  __syncthreads();
  if (threadIdx.x >= 8) return;
  Real extreme = kNone;
  bool any_of_block = false;
  for (unsigned w = 0; w < kGridWarps; ++w) {
    extreme = extreme > s.extremes[threadIdx.x][w] ? extreme : s.extremes[threadIdx.x][w];
    any_of_block = any_of_block || s.any[w];
  }
  if (!any_of_block) return;
  SearchState& state = *args.state;
  if (threadIdx.x == 0) {
    atomicMax(&state.largest_half, bits_of(extreme));
  } else if (threadIdx.x == 1) {
    atomicMax(&state.smallest_half, ~bits_of(-extreme));
  } else {
    atomicMax(&state.farthest[threadIdx.x - 2], ordered(extreme));
  }
}

/// Whether radii differ so much that there could be more than one level.
__device__ inline bool needs_sample(const SearchState& state) {
  const Real smallest = std::bit_cast<Real>(static_cast<RealBits>(~state.smallest_half));
  return level_for(smallest, {half_0_of(&state)}) > 0;
}

/// Counts, level by level, the pairs of a sample that would share a cell. A slot of the block's
/// hash table holds 19 bits of a cell's hash and the spheres met there.
__device__ inline void sample_cells(const GridArgs& args, BuildStorage& s) {
  const GridScale all_levels{half_0_of(args.state)};
  const Real smallest = std::bit_cast<Real>(static_cast<RealBits>(~args.state->smallest_half));
  const int finest = level_for(smallest, all_levels);
  const std::uint32_t samples = min(args.n, kSamples);
  constexpr std::uint32_t kSlotMask = 2 * kSamples - 1;
  for (int level = static_cast<int>(blockIdx.x); level < finest;
       level += static_cast<int>(gridDim.x)) {
    __syncthreads();
    for (unsigned i = threadIdx.x; i < 2 * kSamples; i += blockDim.x) s.samples[i] = 0;
    __syncthreads();
    const Real inverse = inverse_width(half_cell_of(all_levels.half_0, level));
    std::uint32_t pairs = 0;
    for (std::uint32_t k = threadIdx.x; k < samples; k += blockDim.x) {
      // Multiples of the golden ratio, modulo 1: evenly spread over any order of the spheres.
      const std::uint32_t place = k * 0x9e3779b9u;
      const std::uint32_t i = args.n > samples ? __umulhi(place, args.n) : k;
      const SphereInstance sphere = load_sphere(args.spheres + i);
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
    pairs = warp_reduce(pairs, [](unsigned p, unsigned q) { return p + q; });
    if (lane_id() == 0) atomicAdd(&args.state->same_cell[level], pairs);
  }
}

/// Gives each sphere a bucket and its rank there; fills the histogram of the buckets.
__device__ inline void assign(const GridArgs& args, const GridPlan& plan) {
  unsigned level_bits = 0;
  for (std::uint64_t first = grid_thread(); first < args.n; first += kBatch * all_threads()) {
    std::uint32_t buckets[kBatch], ranks[kBatch];
#pragma unroll
    for (unsigned k = 0; k < kBatch; ++k) {
      const std::uint64_t i = first + k * all_threads();
      const SphereInstance sphere = load_sphere(args.spheres + (i < args.n ? i : first));
      buckets[k] = plan.bucket_of(sphere);
      if (!plan.single && !is_far(sphere)) level_bits |= 1u << level_of(sphere, plan.scale);
    }
#pragma unroll
    for (unsigned k = 0; k < kBatch; ++k) {
      if (first + k * all_threads() < args.n) ranks[k] = atomicAdd(&args.table[buckets[k]], 1u);
    }
#pragma unroll
    for (unsigned k = 0; k < kBatch; ++k) {
      const std::uint64_t i = first + k * all_threads();
      if (i < args.n) args.places[i] = buckets[k], args.ranks[i] = ranks[k];
    }
  }
  const unsigned levels = warp_reduce(level_bits, [](unsigned p, unsigned q) { return p | q; });
  if (lane_id() == 0 && levels != 0) atomicOr(&args.state->levels, levels);
}

/// First half of the scan of the table: each block's share.
__device__ inline void sum_table(const GridArgs& args, const GridPlan& plan, BuildStorage& s) {
  const Span span = span_of_block(plan.buckets, 4);
  unsigned long long sum = 0;
  for (std::uint64_t i = span.first + 4 * threadIdx.x; i < span.past; i += 4 * kGridThreads) {
    const uint4 v = *reinterpret_cast<const uint4*>(args.table + i);
    sum += v.x + v.y + v.z + v.w;
  }
  sum = block_sum(sum, s.warp_sums);
  if (threadIdx.x == 0) args.table_sums[blockIdx.x] = sum;
}

/// The histogram of the buckets becomes their starts, with n after the last one.
__device__ inline void scan_table(const GridArgs& args, const GridPlan& plan, BuildStorage& s) {
  unsigned long long before = sum_of_blocks_before(args.table_sums, s.warp_sums);
  if (blockIdx.x == 0 && threadIdx.x == 0) args.table[plan.buckets] = args.n;
  const Span span = span_of_block(plan.buckets, 4);
  for (std::uint64_t first = span.first; first < span.past; first += 4 * kGridThreads) {
    const std::uint64_t i = first + 4 * threadIdx.x;
    uint4 v{0, 0, 0, 0};
    if (i < span.past) v = *reinterpret_cast<const uint4*>(args.table + i);
    __syncthreads();
    unsigned long long total = 0;
    const auto start = static_cast<std::uint32_t>(
        before + block_exclusive_sum(v.x + v.y + v.z + v.w, s.warp_sums, total));
    before += total;
    const uint4 starts{start, start + v.x, start + v.x + v.y, start + v.x + v.y + v.z};
    if (i + 4 <= span.past) {
      *reinterpret_cast<uint4*>(args.table + i) = starts;
    } else if (i < span.past) {  // the entry after the last bucket is another thread's
      args.table[i] = starts.x;
      if (i + 1 < span.past) args.table[i + 1] = starts.y;
      if (i + 2 < span.past) args.table[i + 2] = starts.z;
    }
  }
}

/// Sorts spheres by bucket. Places become positions.
__device__ inline void scatter(const GridArgs& args) {
  for (std::uint64_t first = grid_thread(); first < args.n; first += kBatch * all_threads()) {
    std::uint32_t to[kBatch];
#pragma unroll
    for (unsigned k = 0; k < kBatch; ++k) {
      const std::uint64_t i = first + k * all_threads();
      const std::uint64_t from = i < args.n ? i : first;
      to[k] = args.table[args.places[from]] + args.ranks[from];
    }
#pragma unroll
    for (unsigned k = 0; k < kBatch; ++k) {
      const std::uint64_t i = first + k * all_threads();
      if (i >= args.n) break;
      args.places[i] = to[k];
      args.ids[to[k]] = static_cast<std::uint32_t>(i);
      args.sorted[to[k]] = load_sphere(args.spheres + i);
    }
  }
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
