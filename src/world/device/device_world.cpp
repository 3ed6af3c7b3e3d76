/// Selection of the device of a world. Only this file depends on whether the build includes CUDA.
#include "src/world/device/device_world.hpp"

#include <jfpx/error.hpp>

#if JFPX_HAS_CUDA
#include "src/world/cuda/world_cuda.hpp"
#endif

namespace jfpx {
inline namespace JFPX_ABI {

#if JFPX_HAS_CUDA
std::unique_ptr<DeviceWorld> make_device_world(const Scene& scene,
                                               const std::vector<int>& devices) {
  return cuda::make_world(scene, devices);
}
#else
std::unique_ptr<DeviceWorld> make_device_world(const Scene&, const std::vector<int>&) {
  throw BackendUnavailable("cuda: built without CUDA");
}
#endif

}  // namespace JFPX_ABI
}  // namespace jfpx
