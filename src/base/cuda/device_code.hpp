/// Queries about the code of this build for the current device.
#pragma once

#include <jfpx/config.hpp>

#include <cuda_runtime_api.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// cudaSuccess if this build has machine code or PTX that the current device can run.
cudaError_t kernels_loadable();

/// Whether the code that the current device runs was compiled for compute capability 9.0 or newer.
/// A Hopper GPU also runs code that was compiled for older GPUs; such code supports neither
/// programmatic dependent launch nor thread block clusters.
/// @throws DeviceError. Thread-safe.
bool has_hopper_code();

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
