/// The sphere-sphere algorithm alone, for programs that keep their own dispatcher.
#pragma once

#include <jfpx/bullet/abi.hpp>

#include <BulletCollision/BroadphaseCollision/btDispatcher.h>
#include <BulletCollision/CollisionDispatch/btActivatingCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCollisionCreateFunc.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// What btSphereSphereCollisionAlgorithm does, bit for bit, with jfpx's own arithmetic. One pair at
/// a time, so it is not faster: it is for those who want jfpx's contacts in a dispatcher of their
/// own, and for checking one against the other. Register it before bodies overlap:
///
///     jfpx::bullet::SphereSphereAlgorithm::CreateFunc create;  // must outlive the dispatcher
///     constexpr int kSphere = SPHERE_SHAPE_PROXYTYPE;
///     dispatcher.registerCollisionCreateFunc(kSphere, kSphere, &create);
///
/// and, for contactTest() and contactPairTest(), registerClosestPointsCreateFunc() likewise. It
/// serves children of compounds too. A jfpx::bullet::CollisionDispatcher needs none of this, and
/// leaves sphere pairs to Bullet's one-by-one path when it finds another create function.
/// Threads: as Bullet's algorithms.
class JFPX_API SphereSphereAlgorithm final : public btActivatingCollisionAlgorithm {
 public:
  /// Takes a manifold from the dispatcher, as Bullet's algorithm does when it is created through
  /// its create function. Without one (the pool is exhausted) the algorithm does nothing.
  SphereSphereAlgorithm(const btCollisionAlgorithmConstructionInfo& info,
                        const btCollisionObjectWrapper* body0,
                        const btCollisionObjectWrapper* body1);
  ~SphereSphereAlgorithm() override;
  SphereSphereAlgorithm(const SphereSphereAlgorithm&) = delete;
  SphereSphereAlgorithm& operator=(const SphereSphereAlgorithm&) = delete;

  void processCollision(const btCollisionObjectWrapper* body0,
                        const btCollisionObjectWrapper* body1, const btDispatcherInfo& info,
                        btManifoldResult* result) override;
  /// Always 1, as in Bullet, which does not implement it for spheres either.
  btScalar calculateTimeOfImpact(btCollisionObject* body0, btCollisionObject* body1,
                                 const btDispatcherInfo& info, btManifoldResult* result) override;
  void getAllContactManifolds(btManifoldArray& manifolds) override;

  /// Ignores a shared manifold, as Bullet's does: inside compounds every child has its own.
  struct JFPX_API CreateFunc final : btCollisionAlgorithmCreateFunc {
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
