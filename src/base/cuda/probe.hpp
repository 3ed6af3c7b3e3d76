/// Queries whether a CUDA device can be used.
#pragma once

#include <jfpx/backend.hpp>

#include <cuda_runtime_api.h>

#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Status of a device. Does not throw for a missing or unusable device, and leaves no CUDA error
/// behind.
BackendStatus probe(int device = 0);

/// Explains an `error` of the first CUDA calls, given the CUDA version that the driver supports (0:
/// no driver is installed) and the version of the runtime that this build uses. 13000 denotes
/// version 13.0.
std::string why_unusable(cudaError_t error, int driver, int runtime);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
