/// Two-level counting sort of many spheres by cell, which avoids random access to global memory.
/// The first level sorts tiles of spheres in shared memory and writes them in runs to coarse
/// buckets of consecutive cells. On the second level, each block sorts a coarse bucket.
#pragma once

#include "src/sphere_collider/cuda/grid_build.cuh"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

inline constexpr unsigned kCountThreads = 1024;

/// Tile of spheres in shared memory. A larger tile writes longer runs and needs fewer atomics. The
/// large tile uses most of the shared memory of Hopper. The small tile uses less than 64 KiB, which
/// every supported device has.
template <bool kLarge>
struct TileStorage {
  static constexpr unsigned kThreads = kLarge ? 1024 : 512;
  static constexpr unsigned kOfThread = (kLarge ? 32 : 16) / sizeof(Real);
  static constexpr unsigned kSpheres = kThreads * kOfThread;
  SphereInstance spheres[kSpheres];
  std::uint32_t ids[kSpheres];
  std::uint32_t counts[kCoarseBuckets];  // spheres of the tile by bucket, then their exclusive sums
  std::uint32_t shifts[kCoarseBuckets];  // index in the output minus index in the tile
  std::uint16_t buckets[kSpheres];
};
static_assert(sizeof(TileStorage<false>) <= 64000 && sizeof(TileStorage<true>) <= 220000);

__device__ inline std::uint32_t coarse_bucket(const GridPlan& plan, const SphereInstance& s) {
  return plan.bucket_of(s) >> plan.coarse_shift;
}

/// Block-wide sums in 32 bits, which suffice because no sum of counts exceeds the number of
/// spheres.
template <unsigned kThreads>
using CountSums =
    cub::BlockScan<std::uint32_t, static_cast<int>(kThreads), cub::BLOCK_SCAN_WARP_SCANS>;
template <unsigned kThreads>
using CountSumStorage = typename CountSums<kThreads>::TempStorage;

/// Counts the spheres of the coarse buckets. The last block also computes their starts.
__device__ inline void count_coarse(const GridArgs& args, const GridPlan& plan,
                                    std::uint32_t* counts, CountSumStorage<kCountThreads>& sums) {
  for (unsigned k = threadIdx.x; k < kCoarseBuckets; k += kCountThreads) counts[k] = 0;
  __syncthreads();
  unsigned level_bits = 0;
  const std::uint64_t stride = std::uint64_t{gridDim.x} * kCountThreads;
  for (std::uint64_t first = blockIdx.x * kCountThreads + threadIdx.x; first < args.input.n;
       first += kBatch * stride) {
    SphereInstance spheres[kBatch];
#pragma unroll
    for (unsigned k = 0; k < kBatch; ++k) {
      const std::uint64_t i = first + k * stride;
      spheres[k] = load_sphere(args.input.spheres + (i < args.input.n ? i : first));
    }
#pragma unroll
    for (unsigned k = 0; k < kBatch; ++k) {
      if (first + k * stride >= args.input.n) continue;
      atomicAdd(&counts[coarse_bucket(plan, spheres[k])], 1u);
      if (!plan.single && !is_far(spheres[k])) level_bits |= 1u << level_of(spheres[k], plan.scale);
    }
  }
  const unsigned levels = warp_reduce(level_bits, [](unsigned p, unsigned q) { return p | q; });
  if (lane_id() == 0 && levels != 0) atomicOr(&args.state->levels, levels);
  __syncthreads();
  for (unsigned k = threadIdx.x; k < kCoarseBuckets; k += kCountThreads) {
    if (counts[k] != 0) atomicAdd(&args.table.coarse->counts[k].value, counts[k]);
  }
  if (!is_last_block(args.state->blocks_counted)) return;
  constexpr unsigned kOfThread = kCoarseBuckets / kCountThreads;
  std::uint32_t starts[kOfThread];
#pragma unroll
  for (unsigned k = 0; k < kOfThread; ++k) {
    starts[k] = __ldcg(&args.table.coarse->counts[kOfThread * threadIdx.x + k].value);
  }
  CountSums<kCountThreads>(sums).ExclusiveSum(starts, starts);
#pragma unroll
  for (unsigned k = 0; k < kOfThread; ++k) {
    const unsigned bucket = kOfThread * threadIdx.x + k;
    args.table.coarse->starts[bucket] = args.table.coarse->next[bucket].value = starts[k];
  }
  if (threadIdx.x == 0) args.table.coarse->starts[kCoarseBuckets] = args.input.n;
}

/// Sorts a tile of spheres by coarse bucket, and writes it to Scratch::partitioned.
/// @param size of a tile, but the last
template <bool kLarge>
__device__ inline void partition(const GridArgs& args, const GridPlan& plan, unsigned size,
                                 TileStorage<kLarge>& s,
                                 CountSumStorage<TileStorage<kLarge>::kThreads>& sums) {
  constexpr unsigned kThreads = s.kThreads, kOfThread = s.kOfThread;
  const std::uint64_t tile = std::uint64_t{blockIdx.x} * size;
  const auto count =
      static_cast<unsigned>(min(std::uint64_t{args.input.n} - tile, std::uint64_t{size}));
  SphereInstance spheres[kOfThread];
#pragma unroll
  for (unsigned k = 0; k < kOfThread; ++k) {
    const unsigned i = k * kThreads + threadIdx.x;
    spheres[k] = load_sphere(args.input.spheres + tile + (i < count ? i : 0));
  }
  for (unsigned k = threadIdx.x; k < kCoarseBuckets; k += kThreads) s.counts[k] = 0;
  __syncthreads();
  std::uint32_t tile_places[kOfThread];  // 16 bits bucket, 16 bits rank in the bucket
  static_assert(kCoarseBuckets <= 1 << 16 && s.kSpheres <= 1 << 16);
#pragma unroll
  for (unsigned k = 0; k < kOfThread; ++k) {
    const std::uint32_t bucket = coarse_bucket(plan, spheres[k]);
    if (k * kThreads + threadIdx.x < count) {
      tile_places[k] = bucket << 16 | atomicAdd(&s.counts[bucket], 1u);
    }
  }
  __syncthreads();
  constexpr unsigned kScanned = kCoarseBuckets / kThreads;
  std::uint32_t starts[kScanned], shifts[kScanned];
#pragma unroll
  for (unsigned k = 0; k < kScanned; ++k) {
    const unsigned bucket = kScanned * threadIdx.x + k;
    starts[k] = s.counts[bucket];
    shifts[k] = starts[k] != 0 ? atomicAdd(&args.table.coarse->next[bucket].value, starts[k]) : 0;
  }
  CountSums<kThreads>(sums).ExclusiveSum(starts, starts);
#pragma unroll
  for (unsigned k = 0; k < kScanned; ++k) {
    const unsigned bucket = kScanned * threadIdx.x + k;
    s.counts[bucket] = starts[k];
    s.shifts[bucket] = shifts[k] - starts[k];
  }
  __syncthreads();
#pragma unroll
  for (unsigned k = 0; k < kOfThread; ++k) {
    const unsigned i = k * kThreads + threadIdx.x;
    if (i >= count) continue;
    const std::uint32_t bucket = tile_places[k] >> 16,
                        to = s.counts[bucket] + (tile_places[k] & 0xffffu);
    s.spheres[to] = spheres[k];
    s.ids[to] = id_of(args.input, tile + i);
    s.buckets[to] = static_cast<std::uint16_t>(bucket);
  }
  __syncthreads();
  for (unsigned i = threadIdx.x; i < count; i += kThreads) {
    const std::uint32_t to = s.shifts[s.buckets[i]] + i;
    args.scratch.partitioned[to] = s.spheres[i];
    args.scratch.partitioned_ids[to] = s.ids[i];
  }
}

/// Number of buckets and spheres for which a block that sorts a coarse bucket has shared memory.
struct SortCapacity {
  std::uint32_t buckets;  ///< a multiple of 4
  std::uint32_t spheres;  ///< less than 2^16
  __host__ __device__ std::size_t bytes() const {
    return buckets * sizeof(std::uint32_t) +
           spheres * (sizeof(SphereInstance) + sizeof(std::uint32_t) + sizeof(std::uint16_t));
  }
};
struct SortStorage {
  std::uint32_t* counts;    // spheres of each bucket, then the position of its next sphere
  SphereInstance* spheres;  // spheres of the coarse bucket
  std::uint32_t* ids;       // their ids
  std::uint16_t* order;     // their order by bucket, as indices of `spheres`
};
__device__ inline SortStorage sort_storage(unsigned char* memory, const SortCapacity& capacity) {
  auto* const spheres = reinterpret_cast<SphereInstance*>(memory);
  auto* const counts = reinterpret_cast<std::uint32_t*>(spheres + capacity.spheres);
  std::uint32_t* const ids = counts + capacity.buckets;
  return {counts, spheres, ids, reinterpret_cast<std::uint16_t*>(ids + capacity.spheres)};
}

/// Calls visit(i, spheres[i]) for first <= i < past, distributed over the threads of the block.
template <typename Visit>
__device__ inline void for_each_sphere(const SphereInstance* spheres, std::uint32_t first,
                                       std::uint32_t past, Visit visit) {
  for (std::uint32_t from = first + threadIdx.x; from < past; from += kBatch * blockDim.x) {
    SphereInstance batch[kBatch];
#pragma unroll
    for (unsigned k = 0; k < kBatch; ++k) {
      batch[k] = load_sphere(spheres + min(from + k * blockDim.x, past - 1));
    }
#pragma unroll
    for (unsigned k = 0; k < kBatch; ++k) {
      if (from + k * blockDim.x < past) visit(from + k * blockDim.x, batch[k]);
    }
  }
}

/// Replaces the counts of `count` buckets from `first_bucket` on by their starts, in shared memory
/// and in the table. `before` is the start of the first bucket and is set to the end of the last.
template <unsigned kThreads>
__device__ inline void start_buckets(const GridArgs& args, std::uint64_t first_bucket,
                                     std::uint32_t count, std::uint32_t& before,
                                     const SortStorage& s, CountSumStorage<kThreads>& sums) {
  for (std::uint32_t from = 0; from < count; from += 4 * kThreads) {
    const std::uint32_t k = from + 4 * threadIdx.x;
    uint4 v{0, 0, 0, 0};
    if (k < count) v = *reinterpret_cast<const uint4*>(s.counts + k);
    std::uint32_t starts[4] = {v.x, v.y, v.z, v.w}, total = 0;
    CountSums<kThreads>(sums).ExclusiveSum(starts, starts, total);
#pragma unroll
    for (unsigned j = 0; j < 4; ++j) {
      if (k + j < count)
        s.counts[k + j] = args.table.starts[first_bucket + k + j] = before + starts[j];
    }
    before += total;
    __syncthreads();
  }
}

/// A block sorts the spheres of a coarse bucket by bucket, and writes the starts of its buckets to
/// the table. If all spheres and buckets fit, they are sorted in shared memory. Otherwise each pass
/// over the spheres scatters those of some of the buckets to global memory.
template <unsigned kThreads>
__device__ inline void sort_coarse(const GridArgs& args, const GridPlan& plan,
                                   const SortCapacity& capacity, const SortStorage& s,
                                   CountSumStorage<kThreads>& sums) {
  const std::uint64_t first_bucket = std::uint64_t{blockIdx.x} << plan.coarse_shift;
  if (first_bucket >= plan.buckets) return;
  const std::uint64_t past_bucket =
      min(first_bucket + (std::uint64_t{1} << plan.coarse_shift), std::uint64_t{plan.buckets});
  const std::uint32_t first = args.table.coarse->starts[blockIdx.x];
  const std::uint32_t past = args.table.coarse->starts[blockIdx.x + 1];
  if (past_bucket == plan.buckets) {
    if (threadIdx.x == 0) args.table.starts[plan.buckets] = args.input.n;
    if (threadIdx.x < kReadBeyond) args.table.sorted[args.input.n + threadIdx.x] = {};
  }
  const bool fits =
      past_bucket - first_bucket <= capacity.buckets && past - first <= capacity.spheres;
  std::uint32_t before = first;
  for (std::uint64_t buckets = first_bucket; buckets < past_bucket; buckets += capacity.buckets) {
    const auto count =
        static_cast<std::uint32_t>(min(past_bucket - buckets, std::uint64_t{capacity.buckets}));
    const auto bucket_of = [&](const SphereInstance& sphere) {  // >= count: not in this pass
      return plan.bucket_of(sphere) - static_cast<std::uint32_t>(buckets);
    };
    for (std::uint32_t k = threadIdx.x; k < (count + 3) / 4 * 4; k += blockDim.x) s.counts[k] = 0;
    __syncthreads();
    for_each_sphere(
        args.scratch.partitioned, first, past, [&](std::uint32_t i, const SphereInstance& sphere) {
          if (fits)
            s.spheres[i - first] = sphere, s.ids[i - first] = args.scratch.partitioned_ids[i];
          const std::uint32_t bucket = bucket_of(sphere);
          if (bucket < count) atomicAdd(&s.counts[bucket], 1u);
        });
    __syncthreads();
    start_buckets<kThreads>(args, buckets, count, before, s, sums);
    const auto place = [&](std::uint32_t to, std::uint32_t id, const SphereInstance& sphere) {
      args.table.sorted[to] = sphere;
      args.table.ids[to] = id;
      if (plan.single) return;
      if (!args.input.is_periodic()) {
        args.table.positions[id] = to;
      } else if (!is_image(id)) {
        args.table.positions[index_of<true>(args.input, id)] = to;
      }
    };
    if (fits) {
      for (std::uint32_t i = threadIdx.x; i < past - first; i += blockDim.x) {
        const std::uint32_t to = atomicAdd(&s.counts[bucket_of(s.spheres[i])], 1u) - first;
        s.order[to] = static_cast<std::uint16_t>(i);
      }
      __syncthreads();
      for (std::uint32_t k = threadIdx.x; k < past - first; k += blockDim.x) {
        const unsigned i = s.order[k];
        place(first + k, s.ids[i], s.spheres[i]);
      }
    } else {
      for_each_sphere(args.scratch.partitioned, first, past,
                      [&](std::uint32_t i, const SphereInstance& sphere) {
                        const std::uint32_t bucket = bucket_of(sphere);
                        if (bucket < count) {
                          place(atomicAdd(&s.counts[bucket], 1u), args.scratch.partitioned_ids[i],
                                sphere);
                        }
                      });
    }
    __syncthreads();
  }
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
