/// A translation unit that is compiled for a processor with FMA, with fused products and sums.
#include "tests/bullet/fused_unit.hpp"

#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

// Not std::make_unique: the linker may replace its instantiation here by that of another unit.

std::unique_ptr<CollisionDispatcher> FusedUnit::dispatcher(btCollisionConfiguration* configuration,
                                                           const DispatcherOptions& options) {
  return std::unique_ptr<CollisionDispatcher>(new CollisionDispatcher(configuration, options));
}
std::unique_ptr<CollisionDispatcher> FusedUnit::dispatcher(btCollisionConfiguration* configuration,
                                                           std::unique_ptr<SphereCollider> collider,
                                                           const DispatcherOptions& options) {
  return std::unique_ptr<CollisionDispatcher>(
      new CollisionDispatcher(configuration, std::move(collider), options));
}
std::unique_ptr<SceneWorld> FusedUnit::scene_world(const Scene& scene,
                                                   const SceneWorldOptions& options) {
  return std::unique_ptr<SceneWorld>(new SceneWorld(scene, options));
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
