/// The GPUs on which tests of device worlds run.
#pragma once

#include <jfpx/backend.hpp>

#include "src/world/device/device_world.hpp"

#include <cstdlib>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

struct CudaDevices {
  friend void PrintTo(const CudaDevices& all, std::ostream* out) { *out << all.name; }
  std::string name;
  std::vector<int> devices;  ///< of make_device_world()
  std::unique_ptr<DeviceWorld> operator()(const Scene& scene) const {
    return make_device_world(scene, devices);
  }
};

/// The first GPU, if there is one or JFPX_REQUIRE_CUDA is set.
inline std::vector<CudaDevices> one_cuda_device() {
  bool has_device = std::getenv("JFPX_REQUIRE_CUDA") != nullptr;
  for (const BackendStatus& status : available_backends()) {
    has_device = has_device || (status.backend == Backend::cuda && status.usable);
  }
  return has_device ? std::vector<CudaDevices>{{"Cuda", {0}}} : std::vector<CudaDevices>{};
}

/// Several parts of a GPU, and two linked GPUs if there are two. They share only worlds with
/// blocks.
inline std::vector<CudaDevices> several_cuda_devices() {
  if (one_cuda_device().empty()) return {};
  std::vector<CudaDevices> several{{"CudaTwoParts", {0, 0}}, {"CudaThreeParts", {0, 0, 0}}};
  const std::vector<Gpu> gpus = available_gpus();
  if (!gpus.empty() && !gpus[0].linked.empty()) {
    several.push_back({"CudaTwoDevices", {0, gpus[0].linked[0]}});
  }
  return several;
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
