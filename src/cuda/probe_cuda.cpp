/// Asks the CUDA runtime whether a device can be used, and turns its answer into a sentence.
#include "src/cuda/probe_cuda.hpp"

#include <cuda_runtime_api.h>

#include <string>

namespace jfpx::inline JFPX_ABI::cuda {
namespace {

/// 13000 -> "13.0"
std::string version_text(int version) {
  return std::to_string(version / 1000) + "." + std::to_string(version % 1000 / 10);
}

std::string why_unusable(cudaError_t error) {
  if (error == cudaErrorNoDevice) return "the CUDA driver sees no GPU";
  if (error == cudaErrorInsufficientDriver) {
    int driver = 0, runtime = 0;
    static_cast<void>(cudaDriverGetVersion(&driver));
    static_cast<void>(cudaRuntimeGetVersion(&runtime));
    if (driver == 0) return "no CUDA driver is installed";
    return "the CUDA driver is too old: it supports CUDA " + version_text(driver) +
           ", this build needs " + version_text(runtime);
  }
  return std::string(cudaGetErrorName(error)) + ": " + cudaGetErrorString(error);
}

}  // namespace

BackendStatus probe() {
  BackendStatus status{
      .backend = Backend::cuda, .compiled = true, .usable = false, .device = {}, .reason = {}};
  int count = 0;
  cudaError_t error = cudaGetDeviceCount(&count);
  cudaDeviceProp properties{};
  if (error == cudaSuccess) error = cudaGetDeviceProperties(&properties, 0);
  static_cast<void>(cudaGetLastError());
  if (error != cudaSuccess) {
    status.reason = why_unusable(error);
    return status;
  }
  status.usable = true;
  status.device = std::string(properties.name) + " (compute capability " +
                  std::to_string(properties.major) + "." + std::to_string(properties.minor) + ", " +
                  std::to_string(properties.totalGlobalMem >> 20) + " MiB)";
  return status;
}

}  // namespace jfpx::inline JFPX_ABI::cuda
