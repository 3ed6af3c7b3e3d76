/// Small N: the whole search in one launch, by one cluster of thread blocks.
#include "src/cuda/cuda_try.hpp"
#include "src/cuda/sphere_filter.hpp"
#include "src/cuda/tiles.cuh"

#include <cooperative_groups.h>

namespace jfpx::inline JFPX_ABI::cuda {
namespace {

namespace cg = cooperative_groups;

constexpr unsigned kBlocks = 16;  // the largest cluster that Hopper can have
constexpr unsigned kThreads = 512;
constexpr unsigned kWarps = kBlocks * kThreads / 32;
[[maybe_unused]] constexpr unsigned kRowsPerWarp = kFusedSpheres / kWarps;

// [[maybe_unused]]: clusters exist from Hopper on, so the code for older devices has an empty
// kernel.
struct FusedStorage {
  SphereInstance spheres[kFusedSpheres];
  std::uint32_t counts[kFusedSpheres];   // contacts of each row, gathered from all blocks
  std::uint32_t offsets[kFusedSpheres];  // contacts before each row
  std::uint32_t warp_sums[kThreads / 32];
  std::uint32_t first_invalid;
};

/// offsets becomes the exclusive scan of counts; returns the total. All threads of the block.
[[maybe_unused]] __device__ std::uint32_t scan_rows(FusedStorage& s) {
  constexpr unsigned kPerThread = kFusedSpheres / kThreads;
  std::uint32_t sum = 0;
  for (unsigned k = 0; k < kPerThread; ++k) sum += s.counts[kPerThread * threadIdx.x + k];
  std::uint32_t inclusive = sum;
  for (unsigned d = 1; d < 32; d *= 2) {
    const std::uint32_t below = __shfl_up_sync(kFullWarp, inclusive, d);
    if (lane_id() >= d) inclusive += below;
  }
  if (lane_id() == 31) s.warp_sums[threadIdx.x / 32] = inclusive;
  __syncthreads();
  std::uint32_t before = inclusive - sum, total = 0;
  for (unsigned w = 0; w < kThreads / 32; ++w) {
    if (w < threadIdx.x / 32) before += s.warp_sums[w];
    total += s.warp_sums[w];
  }
  for (unsigned k = 0; k < kPerThread; ++k) {
    s.offsets[kPerThread * threadIdx.x + k] = before;
    before += s.counts[kPerThread * threadIdx.x + k];
  }
  __syncthreads();
  return total;
}

/// The 32 partners 32*word to +31 of row a that touch it and come after it.
[[maybe_unused]] __device__ unsigned touching_word(const FusedStorage& s, std::uint32_t a,
                                                   std::uint32_t word, std::uint32_t n) {
  const std::uint32_t b = 32 * word + lane_id();
  const bool touching = b > a && b < n && may_touch(s.spheres[a], s.spheres[b]) &&
                        shared::test_sphere_pair(s.spheres[a], s.spheres[b]).touching != 0;
  return __ballot_sync(kFullWarp, touching);
}

__global__ void __launch_bounds__(kThreads) fused_search(FusedArgs args) {
#if __CUDA_ARCH__ >= 900
  extern __shared__ __align__(alignof(SphereInstance)) unsigned char raw[];
  FusedStorage& s = *reinterpret_cast<FusedStorage*>(raw);
  const cg::cluster_group cluster = cg::this_cluster();
  const std::uint32_t n = args.n;

  if (threadIdx.x == 0) s.first_invalid = kNoSphere;
  for (unsigned i = threadIdx.x; i < kFusedSpheres; i += kThreads) s.counts[i] = 0;
  __syncthreads();
  for (unsigned i = threadIdx.x; i < n; i += kThreads) {
    s.spheres[i] = load_sphere(args.spheres + i);
    if (!is_valid(s.spheres[i])) atomicMin(&s.first_invalid, i);
  }
  cluster.sync();  // nobody writes into a block that has not started

  // Rows are dealt to warps in turn: early rows are longer. Lane w keeps word w of a row.
  const unsigned warp = threadIdx.x / 32 * kBlocks + cluster.block_rank();
  unsigned words[kRowsPerWarp] = {};
#pragma unroll
  for (unsigned k = 0; k < kRowsPerWarp; ++k) {
    const std::uint32_t a = warp + k * kWarps;
    if (a >= n) continue;
#pragma unroll 4
    for (std::uint32_t w = a / 32; w < (n + 31) / 32; ++w) {
      const unsigned word = touching_word(s, a, w, n);
      if (lane_id() == w) words[k] = word;
    }
    const unsigned count = warp_reduce(static_cast<unsigned>(__popc(words[k])),
                                       [](unsigned p, unsigned q) { return p + q; });
    if (lane_id() < kBlocks) *cluster.map_shared_rank(&s.counts[a], lane_id()) = count;
  }
  cluster.sync();

  const std::uint32_t total = scan_rows(s);
  const bool complete = total <= args.output.capacity;
  if (warp == 0 && lane_id() == 0) write_count(args.output, total, s.first_invalid, complete);
  if (!complete || s.first_invalid != kNoSphere) return;
#pragma unroll
  for (unsigned k = 0; k < kRowsPerWarp; ++k) {
    const std::uint32_t a = warp + k * kWarps;
    if (a >= n) continue;
    emit_row(args.output, s.offsets[a], a, s.spheres[a], 0, words[k],
             [&](std::uint32_t b) { return s.spheres[b]; });
  }
#else
  static_cast<void>(args);
#endif
}

/// Shared memory and cluster size beyond what every device grants.
void allow_resources() {
  JFPX_CUDA_TRY(cudaFuncSetAttribute(fused_search, cudaFuncAttributeMaxDynamicSharedMemorySize,
                                     static_cast<int>(sizeof(FusedStorage))));
  JFPX_CUDA_TRY(
      cudaFuncSetAttribute(fused_search, cudaFuncAttributeNonPortableClusterSizeAllowed, 1));
}

struct Launch {
  Launch() {
    cluster.id = cudaLaunchAttributeClusterDimension;
    cluster.val.clusterDim.x = kBlocks;
    cluster.val.clusterDim.y = 1;
    cluster.val.clusterDim.z = 1;
    config.gridDim = kBlocks;
    config.blockDim = kThreads;
    config.dynamicSmemBytes = sizeof(FusedStorage);
    config.attrs = &cluster;
    config.numAttrs = 1;
  }
  Launch(const Launch&) = delete;
  Launch& operator=(const Launch&) = delete;
  cudaLaunchAttribute cluster{};
  cudaLaunchConfig_t config{};
};

}  // namespace

bool fused_search_supported(int compute_capability_major) {
  if (compute_capability_major < 9) return false;
  allow_resources();
  const Launch launch;
  int most_blocks = 0;
  JFPX_CUDA_TRY(cudaOccupancyMaxPotentialClusterSize(&most_blocks, fused_search, &launch.config));
  return most_blocks >= static_cast<int>(kBlocks);
}

void launch_fused_search(const FusedArgs& args, cudaStream_t stream) {
  allow_resources();
  Launch launch;
  launch.config.stream = stream;
  JFPX_CUDA_TRY(cudaLaunchKernelEx(&launch.config, fused_search, args));
}

}  // namespace jfpx::inline JFPX_ABI::cuda
