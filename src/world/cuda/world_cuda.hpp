/// Factory of worlds on CUDA devices.
#pragma once

#include "src/world/device/device_world.hpp"

#include <memory>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// See make_device_world().
std::unique_ptr<DeviceWorld> make_world(const Scene& scene, const std::vector<int>& devices);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
