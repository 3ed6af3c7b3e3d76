/// Tests of given pairs of spheres.
#pragma once

#include <jfpx/sphere_collider.hpp>

#include "src/sphere_collider/cuda/tuning.hpp"

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Enqueues the tests of m pairs; results[i] belongs to pairs[i]. Does not allocate or wait.
void launch_test_pairs(const SphereInstance* spheres, const SpherePair* pairs, std::size_t m,
                       PairResult* results, cudaStream_t stream);

constexpr std::size_t touching_blocks(std::size_t m) {
  return (m + kTouchingPerBlock - 1) / kTouchingPerBlock;
}

struct TouchingArgs {
  const SphereInstance* spheres;
  const SpherePair* pairs;
  std::size_t m;
  std::uint32_t* counts;      ///< [touching_blocks(m) + 1] per block, and a 0
  unsigned long long* sums;   ///< exclusive scan of `counts`
  PairContact* touching;      ///< [m], may be mapped host memory
  unsigned long long* total;  ///< number of touching pairs, may be in mapped host memory
};
/// Enqueues the count of the touching pairs of each block. Does not allocate or wait.
void launch_count_touching(const TouchingArgs& args, cudaStream_t stream);
/// Enqueues the output of the touching pairs, in the order of the list. Does not allocate or wait.
void launch_emit_touching(const TouchingArgs& args, cudaStream_t stream);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
