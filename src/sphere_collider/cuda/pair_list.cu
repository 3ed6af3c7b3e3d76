/// Tests given pairs: the batch that Bullet's pair cache asks for.
#include "src/sphere_collider/cuda/tiles.cuh"

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

/// The pair of this thread in a round of its block.
__device__ std::size_t pair_of_round(unsigned round) {
  return blockIdx.x * kTouchingPerBlock + round * kThreads + threadIdx.x;
}

/// Whether pair i is there and touches.
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
  __shared__ unsigned of_warp[kThreads / 32];
  unsigned long long base = args.sums[blockIdx.x];
  for (unsigned round = 0; round < kRounds; ++round) {
    PairContact contact;
    const bool touch = find_contact(args, pair_of_round(round), &contact);
    const unsigned votes = __ballot_sync(kFullWarp, touch);
    if (lane_id() == 0) of_warp[threadIdx.x / 32] = static_cast<unsigned>(__popc(votes));
    __syncthreads();
    unsigned before = static_cast<unsigned>(__popc(votes & lanes_below())), all = 0;
    for (unsigned warp = 0; warp < kThreads / 32; ++warp) {
      if (warp < threadIdx.x / 32) before += of_warp[warp];
      all += of_warp[warp];
    }
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
