/// Search among up to 1024 spheres: one launch of one thread block cluster.
#pragma once

#include "src/sphere_collider/cuda/search.hpp"
#include "src/sphere_collider/cuda/tuning.hpp"

#include <cuda_runtime_api.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

struct FusedArgs {
  SphereInput input;  ///< at most kFusedSpheres
  SearchOutput output;
};
/// Whether the current device can run the search, which requires clusters of 16 thread blocks
/// (Hopper) and code that was compiled for Hopper.
bool fused_search_supported();
/// Enqueues the search. Does not allocate or wait.
void launch_fused_search(const FusedArgs& args, cudaStream_t stream);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
