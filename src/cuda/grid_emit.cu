/// Large N, second half: from the partners of each sphere to contacts sorted by (a, b). Where the
/// contacts of an a go is known from the scan of the counts; only the b's of one a are sorted.
#include "src/cuda/grid.cuh"

#include <algorithm>

namespace jfpx::inline JFPX_ABI::cuda {
namespace {

constexpr unsigned kThreads = 256;

constexpr unsigned kCrowdedThreads = 256;
constexpr unsigned kCrowdedWarps = kCrowdedThreads / 32;
constexpr unsigned kCrowdedBlocks = 132 * 4;
constexpr std::uint32_t kWindowWords = 1024;  // bit set of a giant's list: indices at a time / 32
constexpr std::uint32_t kWindow = 32 * kWindowWords;

__device__ bool is_complete(const GridArgs& args, const SearchOutput& output) {
  const unsigned long long total = args.offsets[args.n];
  return total <= args.capacity && total <= output.capacity && args.state->valid_before == 0;
}

struct EmitStorage {
  std::uint32_t partners[kSlots][kThreads];  // sorted
  std::uint32_t starts[kThreads + 1];        // contacts of the block before those of a sphere
  alignas(16) std::uint32_t warp_sums[kThreads / 32];  // no load of it may reach into starts
};

/// A thread sorts the partners of its sphere: few, so by insertion. Returns their number, or 0 if
/// there are too many: these go to the kernel that follows.
__device__ std::uint32_t sort_partners(const GridArgs& args, std::uint32_t a, EmitStorage& s) {
  const std::uint32_t count = args.counts[a];
  if (count > kSlots) {
    if (count > kLongList) {
      args.giants[atomicAdd(&args.state->giants, 1u)] = a;
    } else {
      args.crowded[atomicAdd(&args.state->crowded, 1u)] = a;
    }
    const unsigned long long offset = args.offsets[a];
    for (std::uint32_t k = 0; k < kSlots; ++k) {
      args.crowded_b[offset + k] = args.partners[std::size_t{k} * args.n + a];
    }
    return 0;
  }
  for (std::uint32_t k = 0; k < count; ++k) {
    const std::uint32_t b = args.partners[std::size_t{k} * args.n + a];
    std::uint32_t to = k;
    for (; to > 0 && s.partners[to - 1][threadIdx.x] > b; --to) {
      s.partners[to][threadIdx.x] = s.partners[to - 1][threadIdx.x];
    }
    s.partners[to][threadIdx.x] = b;
  }
  return count;
}

/// Exclusive scan over the block; fills s.starts.
__device__ void scan_starts(std::uint32_t count, EmitStorage& s) {
  std::uint32_t inclusive = count;
  for (unsigned d = 1; d < 32; d *= 2) {
    const std::uint32_t below = __shfl_up_sync(kFullWarp, inclusive, d);
    if (lane_id() >= d) inclusive += below;
  }
  if (lane_id() == 31) s.warp_sums[threadIdx.x / 32] = inclusive;
  __syncthreads();
  for (unsigned w = 0; w < threadIdx.x / 32; ++w) inclusive += s.warp_sums[w];
  s.starts[threadIdx.x + 1] = inclusive;
  if (threadIdx.x == 0) s.starts[0] = 0;
  __syncthreads();
}

/// A block takes the contacts of consecutive a's, which are consecutive in the output: first a
/// thread a sphere, to sort its partners, then a thread a contact.
__global__ void __launch_bounds__(kThreads) emit(GridArgs args, SearchOutput output) {
  wait_for_previous_kernel();
  __shared__ EmitStorage storage;
  const bool complete = is_complete(args, output);
  const std::uint64_t i = std::uint64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (i == 0) write_count(output, args.offsets[args.n], first_invalid(args.state), complete);
  if (!complete) return;
  scan_starts(i < args.n ? sort_partners(args, static_cast<std::uint32_t>(i), storage) : 0,
              storage);
  const std::uint32_t total = storage.starts[kThreads];
  for (std::uint32_t c = threadIdx.x; c < total; c += kThreads) {
    unsigned local = 0;  // the last sphere that starts at or before c
    for (unsigned step = kThreads / 2; step != 0; step /= 2) {
      if (storage.starts[local + step] <= c) local += step;
    }
    const std::uint32_t a = blockIdx.x * kThreads + local;
    const std::uint32_t rank = c - storage.starts[local];
    const std::uint32_t b = storage.partners[rank][local];
    write_contact(output, args.offsets[a] + rank, a, b, load_sphere(args.spheres + a),
                  load_sphere(args.spheres + b));
  }
  const std::uint64_t stride = std::uint64_t{gridDim.x} * kThreads;
  for (std::uint64_t k = i; k < args.state->overflow; k += stride) {
    const OverflowPair pair = args.overflow[k];
    args.crowded_b[args.offsets[pair.a] + pair.rank] = pair.b;
  }
}

/// A warp sorts up to kLongList partners (Batcher's bitonic network) and writes their contacts.
__device__ void emit_crowded_sphere(const GridArgs& args, const SearchOutput& output,
                                    std::uint32_t a, std::uint32_t* ids) {
  const unsigned long long offset = args.offsets[a];
  const std::uint32_t length = args.counts[a];
  std::uint32_t padded = 32;
  while (padded < length) padded *= 2;
  for (unsigned i = lane_id(); i < padded; i += 32) {
    ids[i] = i < length ? args.crowded_b[offset + i] : ~0u;
  }
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
  const SphereInstance sphere = load_sphere(args.spheres + a);
  for (unsigned i = lane_id(); i < length; i += 32) {
    write_contact(output, offset + i, a, ids[i], sphere, load_sphere(args.spheres + ids[i]));
  }
  __syncwarp();
}

/// Of the partners of `a`, takes those in [window, window + kWindow) in order: they become bits of
/// a set. Windows are independent, so a sphere with a million partners is spread over many blocks.
__device__ void emit_window(const GridArgs& args, const SearchOutput& output, std::uint32_t a,
                            unsigned long long offset, std::uint32_t length, std::uint32_t window,
                            std::uint32_t* bits) {
  __shared__ std::uint32_t group_counts[kWindowWords / 32];
  __shared__ std::uint32_t before;
  for (unsigned w = threadIdx.x; w < kWindowWords; w += kCrowdedThreads) bits[w] = 0;
  if (threadIdx.x == 0) before = 0;
  __syncthreads();
  std::uint32_t smaller = 0;
  constexpr unsigned kAtOnce = 16;  // loads in flight: a list can be as long as there are spheres
  for (std::uint32_t first = threadIdx.x; first < length; first += kAtOnce * kCrowdedThreads) {
    std::uint32_t b[kAtOnce];
    for (unsigned k = 0; k < kAtOnce; ++k) {
      const std::uint64_t i = first + std::uint64_t{k} * kCrowdedThreads;
      b[k] = i < length ? args.crowded_b[offset + i] : ~0u;
    }
    for (unsigned k = 0; k < kAtOnce; ++k) {
      smaller += b[k] < window ? 1 : 0;
      if (b[k] >= window && b[k] - window < kWindow && b[k] != ~0u) {
        atomicOr(&bits[(b[k] - window) / 32], 1u << b[k] % 32);
      }
    }
  }
  smaller = warp_reduce(smaller, [](unsigned p, unsigned q) { return p + q; });
  if (lane_id() == 0) atomicAdd(&before, smaller);
  __syncthreads();
  for (unsigned g = threadIdx.x / 32; g < kWindowWords / 32; g += kCrowdedWarps) {
    const auto count = static_cast<unsigned>(__popc(bits[32 * g + lane_id()]));
    group_counts[g] = warp_reduce(count, [](unsigned p, unsigned q) { return p + q; });
  }
  __syncthreads();
  const SphereInstance sphere = load_sphere(args.spheres + a);
  for (unsigned g = threadIdx.x / 32; g < kWindowWords / 32; g += kCrowdedWarps) {
    unsigned long long at = offset + before;
    for (unsigned k = 0; k < g; ++k) at += group_counts[k];
    emit_row(output, at, a, sphere, window / 32 + 32 * g, bits[32 * g + lane_id()],
             [&](std::uint32_t b) { return load_sphere(args.spheres + b); });
  }
}

/// First a warp a crowded sphere, then a block a giant and one window of its partners' indices.
__global__ void __launch_bounds__(kCrowdedThreads)
    emit_crowded(GridArgs args, SearchOutput output) {
  wait_for_previous_kernel();
  __shared__ std::uint32_t storage[kCrowdedWarps * kLongList];
  static_assert(kCrowdedWarps * kLongList >= kWindowWords);
  if ((args.state->crowded | args.state->giants) == 0) return;  // also where emit wrote nothing
  const unsigned warp = threadIdx.x / 32;
  for (std::uint32_t i = blockIdx.x * kCrowdedWarps + warp; i < args.state->crowded;
       i += gridDim.x * kCrowdedWarps) {
    emit_crowded_sphere(args, output, args.crowded[i], storage + warp * kLongList);
  }
  const std::uint32_t windows = (args.n - 1) / kWindow + 1;
  const unsigned long long items = std::uint64_t{args.state->giants} * windows;
  for (unsigned long long item = blockIdx.x; item < items; item += gridDim.x) {
    __syncthreads();
    const std::uint32_t a = args.giants[item / windows];
    emit_window(args, output, a, args.offsets[a], args.counts[a],
                static_cast<std::uint32_t>(item % windows) * kWindow, storage);
  }
}

}  // namespace

void launch_grid_emit(const GridArgs& args, const SearchOutput& output, cudaStream_t stream) {
  const auto blocks = static_cast<unsigned>((std::uint64_t{args.n} + kThreads - 1) / kThreads);
  launch(emit, blocks, 1, kThreads, stream, args, output);
  launch(emit_crowded, kCrowdedBlocks, 1, kCrowdedThreads, stream, args, output);
}

}  // namespace jfpx::inline JFPX_ABI::cuda
