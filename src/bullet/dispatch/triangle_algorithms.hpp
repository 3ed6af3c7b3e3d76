/// Bullet's algorithms for a convex shape and a triangle of a concave shape.
#pragma once

#include <jfpx/config.hpp>

#include <BulletCollision/BroadphaseCollision/btBroadphaseProxy.h>
#include <BulletCollision/CollisionDispatch/btConvexConvexAlgorithm.h>

#include <array>
#include <cstddef>

class btCollisionDispatcher;

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// The create functions that a dispatcher uses for triangles, as far as their algorithms may run on
/// any thread.
class TriangleAlgorithms {
 public:
  /// Reads the table of the dispatcher.
  void read(const btCollisionDispatcher& dispatcher);

  /// Whether SphereTriangleDetector computes the contacts of spheres.
  bool has_stock_sphere() const { return has_stock_sphere_; }
  /// The create function for a type of shape; null if its algorithm may not run on any thread.
  const btConvexConvexAlgorithm::CreateFunc* convex(int shape_type) const {
    return convex_[static_cast<std::size_t>(shape_type)];
  }
  /// Whether Bullet ignores triangles that are separated from a convex shape along their normal
  /// (BT_DISABLE_CONVEX_CONCAVE_EARLY_OUT in Bullet 3.24, BT_ENABLE_... in later versions).
  static bool ignores_separated();

 private:
  bool has_stock_sphere_ = false;
  std::array<const btConvexConvexAlgorithm::CreateFunc*, CONCAVE_SHAPES_START_HERE> convex_{};
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
