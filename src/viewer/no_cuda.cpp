/// Pictures from device memory in a build without CUDA.
#include <jfpx/error.hpp>

#include "src/viewer/world_spheres.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

std::unique_ptr<ResidentSpheres> make_world_spheres(World*, const std::vector<Ball>&) {
  throw BackendUnavailable("cuda: built without CUDA");
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
