/// Asks whether a CUDA device can be used.
#pragma once

#include <jfpx/backend.hpp>

#include <cuda_runtime_api.h>

#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Never throws for a missing or unusable device; leaves no sticky CUDA error behind.
BackendStatus probe(int device = 0);

/// A sentence on what `error` of the first CUDA calls means, where the driver supports CUDA up to
/// `driver` (0: there is none) and this build was made for `runtime`; 13000 stands for 13.0.
std::string why_unusable(cudaError_t error, int driver, int runtime);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
