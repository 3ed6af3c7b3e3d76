/// A translation unit that is compiled for a processor with FMA, with fused products and sums.
#pragma once

#include <jfpx/bullet/scene_world.hpp>

#include <memory>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Constructs the parts in the translation unit that fuses. Only for processors with FMA.
struct FusedUnit {
  static std::unique_ptr<CollisionDispatcher> dispatcher(btCollisionConfiguration* configuration,
                                                         const DispatcherOptions& options);
  static std::unique_ptr<CollisionDispatcher> dispatcher(btCollisionConfiguration* configuration,
                                                         std::unique_ptr<SphereCollider> collider,
                                                         const DispatcherOptions& options);
  static std::unique_ptr<SceneWorld> scene_world(const Scene& scene,
                                                 const SceneWorldOptions& options);
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
