/// The sphere-sphere algorithm alone, for programs with their own dispatcher.
#pragma once

#include <jfpx/build.hpp>
#include <jfpx/bullet/abi.hpp>

#include <BulletCollision/BroadphaseCollision/btDispatcher.h>
#include <BulletCollision/CollisionDispatch/btActivatingCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCollisionCreateFunc.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Bit-identical replacement for btSphereSphereCollisionAlgorithm with jfpx's own arithmetic. It
/// processes one pair at a time, so it is not faster. It serves to compute jfpx's contacts in a
/// custom dispatcher, and to compare the two implementations. Register it before bodies overlap:
///
///     jfpx::bullet::SphereSphereAlgorithm::CreateFunc create;  // must outlive the dispatcher
///     constexpr int kSphere = SPHERE_SHAPE_PROXYTYPE;
///     dispatcher.registerCollisionCreateFunc(kSphere, kSphere, &create);
///
/// and, for contactTest() and contactPairTest(), with registerClosestPointsCreateFunc() as well. It
/// also supports children of compounds. A jfpx::bullet::CollisionDispatcher does not need it: with
/// any SPHERE/SPHERE create function other than Bullet's, every dispatch runs in Bullet's code.
/// Thread safety is that of Bullet's algorithms.
class JFPX_BULLET_API SphereSphereAlgorithm final : public btActivatingCollisionAlgorithm {
 public:
  /// Gets a new manifold from the dispatcher, as the constructor of Bullet's algorithm does for its
  /// create function. If the manifold pool is exhausted, the algorithm has no effect.
  SphereSphereAlgorithm(const btCollisionAlgorithmConstructionInfo& info,
                        const btCollisionObjectWrapper* body0,
                        const btCollisionObjectWrapper* body1);
  ~SphereSphereAlgorithm() override;
  SphereSphereAlgorithm(const SphereSphereAlgorithm&) = delete;
  SphereSphereAlgorithm& operator=(const SphereSphereAlgorithm&) = delete;

  void processCollision(const btCollisionObjectWrapper* body0,
                        const btCollisionObjectWrapper* body1, const btDispatcherInfo& info,
                        btManifoldResult* result) override;
  /// Always 1, because Bullet does not implement it for spheres.
  btScalar calculateTimeOfImpact(btCollisionObject* body0, btCollisionObject* body1,
                                 const btDispatcherInfo& info, btManifoldResult* result) override;
  void getAllContactManifolds(btManifoldArray& manifolds) override;

  /// Create function for a dispatcher. It ignores a manifold in the construction info, as Bullet's
  /// does: in a compound, every child has a manifold of its own.
  struct JFPX_BULLET_API CreateFunc final : btCollisionAlgorithmCreateFunc {
    btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                   const btCollisionObjectWrapper* body0,
                                                   const btCollisionObjectWrapper* body1) override;
  };

 private:
  btPersistentManifold* manifold_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
