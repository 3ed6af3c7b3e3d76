/// Factory of worlds on CUDA devices.
#pragma once

#include "src/world/device/device_world.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// @throws BackendUnavailable with the reason, DeviceError
std::unique_ptr<DeviceWorld> make_world(const Scene& scene, int device);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
