/// Queries whether a CUDA device can be used.
#pragma once

#include <jfpx/backend.hpp>

#include <cuda_runtime_api.h>

#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Status of a device. Does not throw for a missing or unusable device, and leaves no CUDA error
/// pending.
BackendStatus probe(int device = 0);

/// See available_gpus().
std::vector<Gpu> probe_all();

/// @param devices usable ones
/// @returns why these devices cannot share memory; empty if they can @throws DeviceError
std::string why_not_shared(const std::vector<int>& devices);

/// Returns the reason why a device cannot be used.
/// @param error of the first CUDA calls
/// @param driver CUDA version that the driver supports, 13000 for 13.0; 0: no driver is installed
/// @param runtime version of the CUDA runtime that this build uses
std::string why_unusable(cudaError_t error, int driver, int runtime);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
