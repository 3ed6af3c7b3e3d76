/// Sorts many spheres by cell in two steps, so that no step reads or writes memory at random: first
/// into coarse buckets of consecutive cells (a tile of spheres at a time is put in order in shared
/// memory and written in runs), then a block a coarse bucket.
#pragma once

#include "src/sphere_collider/cuda/grid_build.cuh"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

inline constexpr unsigned kCountThreads = 1024;

/// A tile of spheres: the more there are, the longer the runs that are written and the fewer the
/// atomics. A large one takes most of the shared memory of Hopper, a small one less than 64 KiB,
/// which every device has.
template <bool kLarge>
struct TileStorage {
  static constexpr unsigned kThreads = kLarge ? 1024 : 512;
  static constexpr unsigned kOfThread = (kLarge ? 32 : 16) / sizeof(Real);
  static constexpr unsigned kSpheres = kThreads * kOfThread;
  SphereInstance spheres[kSpheres];
  std::uint32_t ids[kSpheres];
  std::uint32_t counts[kCoarseBuckets];  // spheres of the tile, then those before, by bucket
  std::uint32_t shifts[kCoarseBuckets];  // from a place in the tile to one in memory
  std::uint16_t buckets[kSpheres];
};
static_assert(sizeof(TileStorage<false>) <= 64000 && sizeof(TileStorage<true>) <= 220000);

__device__ inline std::uint32_t coarse_bucket(const GridPlan& plan, const SphereInstance& s) {
  return plan.bucket_of(s) >> plan.coarse_shift;
}

/// `values` of consecutive numbers of each thread become the sums of all numbers before them.
template <unsigned kThreads, unsigned kOfThread>
__device__ inline void scan_block(std::uint32_t (&values)[kOfThread],
                                  unsigned long long* warp_sums) {
  std::uint32_t sum = 0;
#pragma unroll
  for (unsigned k = 0; k < kOfThread; ++k) sum += values[k];
  unsigned long long total = 0;
  auto before =
      static_cast<std::uint32_t>(block_exclusive_sum<kThreads / 32>(sum, warp_sums, total));
#pragma unroll
  for (unsigned k = 0; k < kOfThread; ++k) {
    const std::uint32_t value = values[k];
    values[k] = before;
    before += value;
  }
}

/// How many spheres coarse buckets have and, by the last block, where they start.
__device__ inline void count_coarse(const GridArgs& args, const GridPlan& plan,
                                    std::uint32_t* counts, unsigned long long* warp_sums) {
  for (unsigned k = threadIdx.x; k < kCoarseBuckets; k += kCountThreads) counts[k] = 0;
  __syncthreads();
  unsigned level_bits = 0;
  const std::uint64_t stride = std::uint64_t{gridDim.x} * kCountThreads;
  for (std::uint64_t first = blockIdx.x * kCountThreads + threadIdx.x; first < args.n;
       first += kBatch * stride) {
    SphereInstance spheres[kBatch];
#pragma unroll
    for (unsigned k = 0; k < kBatch; ++k) {
      const std::uint64_t i = first + k * stride;
      spheres[k] = load_sphere(args.spheres + (i < args.n ? i : first));
    }
#pragma unroll
    for (unsigned k = 0; k < kBatch; ++k) {
      if (first + k * stride >= args.n) continue;
      atomicAdd(&counts[coarse_bucket(plan, spheres[k])], 1u);
      if (!plan.single && !is_far(spheres[k])) level_bits |= 1u << level_of(spheres[k], plan.scale);
    }
  }
  const unsigned levels = warp_reduce(level_bits, [](unsigned p, unsigned q) { return p | q; });
  if (lane_id() == 0 && levels != 0) atomicOr(&args.state->levels, levels);
  __syncthreads();
  for (unsigned k = threadIdx.x; k < kCoarseBuckets; k += kCountThreads) {
    if (counts[k] != 0) atomicAdd(&args.coarse->counts[k].value, counts[k]);
  }
  if (!is_last_block(args.state->blocks_counted)) return;
  constexpr unsigned kOfThread = kCoarseBuckets / kCountThreads;
  std::uint32_t starts[kOfThread];
#pragma unroll
  for (unsigned k = 0; k < kOfThread; ++k) {
    starts[k] = __ldcg(&args.coarse->counts[kOfThread * threadIdx.x + k].value);
  }
  scan_block<kCountThreads>(starts, warp_sums);
#pragma unroll
  for (unsigned k = 0; k < kOfThread; ++k) {
    const unsigned bucket = kOfThread * threadIdx.x + k;
    args.coarse->starts[bucket] = args.coarse->next[bucket].value = starts[k];
  }
  if (threadIdx.x == 0) args.coarse->starts[kCoarseBuckets] = args.n;
}

/// Brings a tile of spheres into the order of their coarse buckets.
template <bool kLarge>
__device__ inline void part(const GridArgs& args, const GridPlan& plan, TileStorage<kLarge>& s,
                            unsigned long long* warp_sums) {
  constexpr unsigned kThreads = s.kThreads, kOfThread = s.kOfThread;
  const std::uint64_t tile = std::uint64_t{blockIdx.x} * s.kSpheres;
  const auto count =
      static_cast<unsigned>(min(std::uint64_t{args.n} - tile, std::uint64_t{s.kSpheres}));
  SphereInstance spheres[kOfThread];
#pragma unroll
  for (unsigned k = 0; k < kOfThread; ++k) {
    const unsigned i = k * kThreads + threadIdx.x;
    spheres[k] = load_sphere(args.spheres + tile + (i < count ? i : 0));
  }
  for (unsigned k = threadIdx.x; k < kCoarseBuckets; k += kThreads) s.counts[k] = 0;
  __syncthreads();
  std::uint32_t places[kOfThread];  // in the tile: 16 bits bucket, 16 bits rank there
  static_assert(kCoarseBuckets <= 1 << 16 && s.kSpheres <= 1 << 16);
#pragma unroll
  for (unsigned k = 0; k < kOfThread; ++k) {
    const std::uint32_t bucket = coarse_bucket(plan, spheres[k]);
    if (k * kThreads + threadIdx.x < count) {
      places[k] = bucket << 16 | atomicAdd(&s.counts[bucket], 1u);
    }
  }
  __syncthreads();
  constexpr unsigned kScanned = kCoarseBuckets / kThreads;
  std::uint32_t starts[kScanned], shifts[kScanned];
#pragma unroll
  for (unsigned k = 0; k < kScanned; ++k) {
    const unsigned bucket = kScanned * threadIdx.x + k;
    starts[k] = s.counts[bucket];
    shifts[k] = starts[k] != 0 ? atomicAdd(&args.coarse->next[bucket].value, starts[k]) : 0;
  }
  scan_block<kThreads>(starts, warp_sums);
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
    const std::uint32_t bucket = places[k] >> 16, to = s.counts[bucket] + (places[k] & 0xffffu);
    s.spheres[to] = spheres[k];
    s.ids[to] = static_cast<std::uint32_t>(tile + i);
    s.buckets[to] = static_cast<std::uint16_t>(bucket);
  }
  __syncthreads();
  for (unsigned i = threadIdx.x; i < count; i += kThreads) {
    const std::uint32_t to = s.shifts[s.buckets[i]] + i;
    args.parted[to] = s.spheres[i];
    args.parted_ids[to] = s.ids[i];
  }
}

/// What a block has in shared memory to sort a coarse bucket: room for buckets and for spheres.
struct SortRoom {
  std::uint32_t buckets;  ///< a multiple of 4
  std::uint32_t spheres;  ///< less than 2^16
  __host__ __device__ std::size_t bytes() const {
    return buckets * sizeof(std::uint32_t) +
           spheres * (sizeof(SphereInstance) + sizeof(std::uint32_t) + sizeof(std::uint16_t));
  }
};
struct SortStorage {
  std::uint32_t* counts;    // spheres of a bucket, then the place of its next one
  SphereInstance* spheres;  // of the coarse bucket
  std::uint32_t* ids;
  std::uint16_t* order;
  unsigned long long* warp_sums;
};
__device__ inline SortStorage sort_storage(unsigned char* memory, const SortRoom& room,
                                           unsigned long long* warp_sums) {
  auto* const spheres = reinterpret_cast<SphereInstance*>(memory);
  auto* const counts = reinterpret_cast<std::uint32_t*>(spheres + room.spheres);
  std::uint32_t* const ids = counts + room.buckets;
  return {counts, spheres, ids, reinterpret_cast<std::uint16_t*>(ids + room.spheres), warp_sums};
}

/// Calls visit(i, spheres[i]) for first <= i < past, by all threads of a block.
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

/// The counts of `count` buckets from `first_bucket` on become their starts, here and in the table;
/// `before` is the start of the first one.
__device__ inline void start_buckets(const GridArgs& args, std::uint64_t first_bucket,
                                     std::uint32_t count, unsigned long long& before,
                                     SortStorage& s) {
  for (std::uint32_t from = 0; from < count; from += 4 * blockDim.x) {
    const std::uint32_t k = from + 4 * threadIdx.x;
    uint4 v{0, 0, 0, 0};
    if (k < count) v = *reinterpret_cast<const uint4*>(s.counts + k);
    unsigned long long total = 0;
    const auto start = static_cast<std::uint32_t>(
        before + block_exclusive_sum(v.x + v.y + v.z + v.w, s.warp_sums, total, blockDim.x / 32));
    before += total;
    const std::uint32_t starts[4] = {start, start + v.x, start + v.x + v.y,
                                     start + v.x + v.y + v.z};
#pragma unroll
    for (unsigned j = 0; j < 4; ++j) {
      if (k + j < count) s.counts[k + j] = args.table[first_bucket + k + j] = starts[j];
    }
    __syncthreads();
  }
}

/// Sorts the spheres [first, past) of a coarse bucket by bucket, and fills its part of the table
/// with the starts of its buckets. In shared memory, if there is room for all of it; else spheres
/// are written at random, for some of the buckets at a time.
__device__ inline void sort_coarse(const GridArgs& args, const GridPlan& plan, const SortRoom& room,
                                   SortStorage& s) {
  const std::uint64_t first_bucket = std::uint64_t{blockIdx.x} << plan.coarse_shift;
  if (first_bucket >= plan.buckets) return;
  const std::uint64_t past_bucket =
      min(first_bucket + (std::uint64_t{1} << plan.coarse_shift), std::uint64_t{plan.buckets});
  const std::uint32_t first = args.coarse->starts[blockIdx.x];
  const std::uint32_t past = args.coarse->starts[blockIdx.x + 1];
  if (past_bucket == plan.buckets) {
    if (threadIdx.x == 0) args.table[plan.buckets] = args.n;
    if (threadIdx.x < kReadBeyond) args.sorted[args.n + threadIdx.x] = {};
  }
  const bool fits = past_bucket - first_bucket <= room.buckets && past - first <= room.spheres;
  unsigned long long before = first;
  for (std::uint64_t buckets = first_bucket; buckets < past_bucket; buckets += room.buckets) {
    const auto count =
        static_cast<std::uint32_t>(min(past_bucket - buckets, std::uint64_t{room.buckets}));
    const auto bucket_of = [&](const SphereInstance& sphere) {  // count or more: in another turn
      return plan.bucket_of(sphere) - static_cast<std::uint32_t>(buckets);
    };
    for (std::uint32_t k = threadIdx.x; k < (count + 3) / 4 * 4; k += blockDim.x) s.counts[k] = 0;
    __syncthreads();
    for_each_sphere(args.parted, first, past, [&](std::uint32_t i, const SphereInstance& sphere) {
      if (fits) s.spheres[i - first] = sphere, s.ids[i - first] = args.parted_ids[i];
      const std::uint32_t bucket = bucket_of(sphere);
      if (bucket < count) atomicAdd(&s.counts[bucket], 1u);
    });
    __syncthreads();
    start_buckets(args, buckets, count, before, s);
    const auto place = [&](std::uint32_t to, std::uint32_t id, const SphereInstance& sphere) {
      args.sorted[to] = sphere;
      args.ids[to] = id;
      if (!plan.single) args.places[id] = to;
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
      for_each_sphere(args.parted, first, past, [&](std::uint32_t i, const SphereInstance& sphere) {
        const std::uint32_t bucket = bucket_of(sphere);
        if (bucket < count) {
          place(atomicAdd(&s.counts[bucket], 1u), args.parted_ids[i], sphere);
        }
      });
    }
    __syncthreads();
  }
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
