/// Tests given pairs: the batch that Bullet's pair cache asks for.
#include "src/cuda/tiles.cuh"

#include <array>
#include <atomic>

namespace jfpx::inline JFPX_ABI::cuda {
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
      shared::test_sphere_pair(load_sphere(spheres + pair.a), load_sphere(spheres + pair.b));
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
  return shared::find_sphere_contact(load_sphere(args.spheres + pair.a),
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

cudaError_t kernels_loadable() {
  cudaFuncAttributes attributes{};
  return cudaFuncGetAttributes(&attributes, test_pairs);
}

bool has_hopper_code() {
  constexpr int kDevices = 64;
  enum : signed char { kUnknown, kNo, kYes };
  static std::array<std::atomic<signed char>, kDevices> known{};
  int device = 0;
  JFPX_CUDA_TRY(cudaGetDevice(&device));
  const bool remembers = device < kDevices;
  if (remembers && known[device] != kUnknown) return known[device] == kYes;
  cudaFuncAttributes attributes{};
  JFPX_CUDA_TRY(cudaFuncGetAttributes(&attributes, test_pairs));
  const bool yes = attributes.ptxVersion >= 90;
  if (remembers) known[device] = yes ? kYes : kNo;
  return yes;
}

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

}  // namespace jfpx::inline JFPX_ABI::cuda
