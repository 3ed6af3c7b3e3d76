/// Queries the CUDA runtime for a usable device, and explains why a device cannot be used.
#include "src/base/cuda/probe.hpp"

#include <jfpx/error.hpp>

#include "src/base/cuda/cuda_try.hpp"
#include "src/base/cuda/device_code.hpp"

#include <cuda_runtime_api.h>

#include <string>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

/// 13000 -> "13.0"
std::string version_text(int version) {
  return std::to_string(version / 1000) + "." + std::to_string(version % 1000 / 10);
}

/// Compute capability, for example "9.0".
std::string capability(const cudaDeviceProp& properties) {
  return std::to_string(properties.major) + "." + std::to_string(properties.minor);
}

/// cudaSuccess if this build has code for the device. Restores the current device.
cudaError_t code_for(int device) {
  int previous = 0;
  cudaError_t error = cudaGetDevice(&previous);
  if (error == cudaSuccess) error = cudaSetDevice(device);
  if (error == cudaSuccess) error = kernels_loadable();
  static_cast<void>(cudaSetDevice(previous));
  return error;
}

}  // namespace

std::string why_unusable(cudaError_t error, int driver, int runtime) {
  if (error == cudaErrorNoDevice) return "the CUDA driver sees no GPU";
  if (error == cudaErrorInsufficientDriver) {
    if (driver == 0) return "no CUDA driver is installed";
    return "the CUDA driver is too old: it supports CUDA " + version_text(driver) +
           ", this build needs " + version_text(runtime);
  }
  return std::string(cudaGetErrorName(error)) + ": " + cudaGetErrorString(error);
}

BackendStatus probe(int device) {
  BackendStatus status{
      .backend = Backend::cuda, .compiled = true, .usable = false, .device = {}, .reason = {}};
  int count = 0;
  cudaError_t error = cudaGetDeviceCount(&count);
  if (error == cudaSuccess && (device < 0 || device >= count)) {
    status.reason = "there is no device " + std::to_string(device) + ", the driver sees " +
                    std::to_string(count);
    return status;
  }
  cudaDeviceProp properties{};
  if (error == cudaSuccess) error = cudaGetDeviceProperties(&properties, device);
  if (error == cudaSuccess) {
    status.device = std::string(properties.name) + " (compute capability " +
                    capability(properties) + ", " +
                    std::to_string(properties.totalGlobalMem >> 20) + " MiB)";
    error = code_for(device);
  }
  static_cast<void>(cudaGetLastError());
  if (error == cudaErrorNoKernelImageForDevice || error == cudaErrorInvalidDeviceFunction) {
    status.reason = "this build has no code for compute capability " + capability(properties);
  } else if (error != cudaSuccess) {
    int driver = 0, runtime = 0;
    static_cast<void>(cudaDriverGetVersion(&driver));
    static_cast<void>(cudaRuntimeGetVersion(&runtime));
    status.reason = why_unusable(error, driver, runtime);
  }
  status.usable = error == cudaSuccess;
  return status;
}

std::string why_not_shared(const std::vector<int>& devices) {
  for (const int from : devices) {
    for (const int to : devices) {
      if (from == to) continue;
      int can = 0, has_atomics = 0;
      JFPX_CUDA_TRY(cudaDeviceCanAccessPeer(&can, from, to));
      const std::string pair =
          "cuda: the GPUs " + std::to_string(from) + " and " + std::to_string(to);
      if (can == 0) return pair + " cannot access each other's memory";
      JFPX_CUDA_TRY(
          cudaDeviceGetP2PAttribute(&has_atomics, cudaDevP2PAttrNativeAtomicSupported, from, to));
      if (has_atomics == 0) return pair + " have no link with atomic operations, such as NVLink";
    }
  }
  return {};
}

std::vector<Gpu> probe_all() {
  int count = 0;
  if (cudaGetDeviceCount(&count) != cudaSuccess) count = 0;
  static_cast<void>(cudaGetLastError());
  std::vector<Gpu> gpus;
  for (int number = 0; number < count; ++number) {
    BackendStatus status = probe(number);
    gpus.push_back({.number = number,
                    .name = std::move(status.device),
                    .usable = status.usable,
                    .reason = std::move(status.reason),
                    .linked = {}});
  }
  for (Gpu& gpu : gpus) {
    for (const Gpu& other : gpus) {
      if (other.number == gpu.number || !gpu.usable || !other.usable) continue;
      try {
        if (!why_not_shared({gpu.number, other.number}).empty()) continue;
      } catch (const DeviceError&) {
        continue;
      }
      gpu.linked.push_back(other.number);
    }
  }
  return gpus;
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
