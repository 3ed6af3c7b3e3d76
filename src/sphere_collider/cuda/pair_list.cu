/// Tests of given pairs, such as the overlapping pairs of Bullet's pair cache.
#include "src/sphere_collider/cuda/pair_list.hpp"
#include "src/sphere_collider/cuda/search.cuh"

#include <cub/block/block_scan.cuh>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

constexpr unsigned kThreads = 256;

__global__ void __launch_bounds__(kThreads)
    test_pairs(const SphereInstance* __restrict__ spheres, const SpherePair* __restrict__ pairs,
               std::size_t m, PairResult* __restrict__ results) {
  wait_for_previous_kernel();
  const std::size_t i = std::size_t{blockIdx.x} * kThreads + threadIdx.x;
  if (i >= m) return;
  const SpherePair pair = pairs[i];
  results[i] =
      detail::test_sphere_pair(load_sphere(spheres + pair.a), load_sphere(spheres + pair.b));
}

constexpr unsigned kRounds = kTouchingPerBlock / kThreads;

/// Index of the pair that this thread tests in a round of its block.
__device__ std::size_t pair_of_round(unsigned round) {
  return blockIdx.x * kTouchingPerBlock + round * kThreads + threadIdx.x;
}

/// Returns whether pair i exists and touches, and computes its contact.
__device__ bool find_contact(const TouchingArgs& args, std::size_t i, PairContact* contact) {
  if (i >= args.m) return false;
  const SpherePair pair = args.pairs[i];
  contact->pair = static_cast<std::uint32_t>(i);
  return detail::find_sphere_contact(load_sphere(args.spheres + pair.a),
                                     load_sphere(args.spheres + pair.b), contact);
}

__global__ void __launch_bounds__(kThreads) count_touching(TouchingArgs args) {
  wait_for_previous_kernel();
  int count = 0;
  for (unsigned round = 0; round < kRounds; ++round) {
    PairContact contact;
    count += __syncthreads_count(find_contact(args, pair_of_round(round), &contact) ? 1 : 0);
  }
  if (threadIdx.x != 0) return;
  args.counts[blockIdx.x] = static_cast<std::uint32_t>(count);
  if (blockIdx.x == 0) args.counts[gridDim.x] = 0;
}

__global__ void __launch_bounds__(kThreads) emit_touching(TouchingArgs args) {
  wait_for_previous_kernel();
  using Sums = cub::BlockScan<unsigned, kThreads, cub::BLOCK_SCAN_WARP_SCANS>;
  __shared__ Sums::TempStorage storage;
  unsigned long long base = args.sums[blockIdx.x];
  for (unsigned round = 0; round < kRounds; ++round) {
    PairContact contact;
    const bool touch = find_contact(args, pair_of_round(round), &contact);
    unsigned before = 0, all = 0;
    Sums(storage).ExclusiveSum(touch ? 1u : 0u, before, all);
    if (touch) args.touching[base + before] = contact;
    base += all;
    __syncthreads();
  }
  if (blockIdx.x == 0 && threadIdx.x == 0) *args.total = args.sums[gridDim.x];
}

}  // namespace

void launch_test_pairs(const SphereInstance* spheres, const SpherePair* pairs, std::size_t m,
                       PairResult* results, cudaStream_t stream) {
  if (m == 0) return;
  launch(test_pairs, static_cast<unsigned>((m + kThreads - 1) / kThreads), 1, kThreads, stream,
         spheres, pairs, m, results);
}

void launch_count_touching(const TouchingArgs& args, cudaStream_t stream) {
  launch(count_touching, static_cast<unsigned>(touching_blocks(args.m)), 1, kThreads, stream, args);
}

void launch_emit_touching(const TouchingArgs& args, cudaStream_t stream) {
  launch(emit_touching, static_cast<unsigned>(touching_blocks(args.m)), 1, kThreads, stream, args);
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
