/// Tests given pairs: the batch that Bullet's pair cache asks for.
#include "src/cuda/tiles.cuh"

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

}  // namespace

cudaError_t kernels_loadable() {
  cudaFuncAttributes attributes{};
  return cudaFuncGetAttributes(&attributes, test_pairs);
}

void launch_test_pairs(const SphereInstance* spheres, const SpherePair* pairs, std::size_t m,
                       PairResult* results, cudaStream_t stream) {
  if (m == 0) return;
  launch(test_pairs, static_cast<unsigned>((m + kThreads - 1) / kThreads), 1, kThreads, stream,
         spheres, pairs, m, results);
}

}  // namespace jfpx::inline JFPX_ABI::cuda
