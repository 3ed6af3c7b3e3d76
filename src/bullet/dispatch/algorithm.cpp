/// Equivalent of btSphereSphereCollisionAlgorithm of Bullet 3.24 for one pair of spheres.
#include <jfpx/bullet/algorithm.hpp>

#include "src/collide/sphere_pair.hpp"

#include <BulletCollision/BroadphaseCollision/btBroadphaseProxy.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionDispatch/btSphereSphereCollisionAlgorithm.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>

#include <new>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

// Bullet does not check that an object fits into an element of its pool, whose default size is that
// of its largest algorithm. An object no larger than the replaced algorithm fits into every pool
// that supports Bullet's algorithm.
static_assert(sizeof(SphereSphereAlgorithm) <= sizeof(btSphereSphereCollisionAlgorithm));
static_assert(alignof(SphereSphereAlgorithm) <= 16, "the alignment of Bullet's pools");

namespace {

SphereInstance sphere_of(const btCollisionObjectWrapper& body) {
  // The wrapper's transform is that of the child if the body is a compound.
  const btVector3& centre = body.getWorldTransform().getOrigin();
  return {{centre.x(), centre.y(), centre.z()},
          static_cast<const btSphereShape*>(body.getCollisionShape())->getRadius()};
}

}  // namespace

SphereSphereAlgorithm::SphereSphereAlgorithm(const btCollisionAlgorithmConstructionInfo& info,
                                             const btCollisionObjectWrapper* body0,
                                             const btCollisionObjectWrapper* body1)
    : btActivatingCollisionAlgorithm(info, body0, body1),
      manifold_(
          m_dispatcher->getNewManifold(body0->getCollisionObject(), body1->getCollisionObject())) {}

SphereSphereAlgorithm::~SphereSphereAlgorithm() {
  if (manifold_ != nullptr) m_dispatcher->releaseManifold(manifold_);
}

void SphereSphereAlgorithm::processCollision(const btCollisionObjectWrapper* body0,
                                             const btCollisionObjectWrapper* body1,
                                             const btDispatcherInfo&, btManifoldResult* result) {
  if (manifold_ == nullptr) return;
  result->setPersistentManifold(manifold_);
  manifold_->clearManifold();
  const SphereInstance a = sphere_of(*body0), b = sphere_of(*body1);
  const PairResult contact =
      detail::test_sphere_pair(a, b, result->m_closestPointDistanceThreshold);
  if (contact.touching == 0) return;
  const btVector3 normal(contact.normal.x, contact.normal.y, contact.normal.z);
  const btVector3 point_on_b = body1->getWorldTransform().getOrigin() + b.radius * normal;
  result->addContactPoint(normal, point_on_b, contact.distance);
}

btScalar SphereSphereAlgorithm::calculateTimeOfImpact(btCollisionObject*, btCollisionObject*,
                                                      const btDispatcherInfo&, btManifoldResult*) {
  return 1;
}

void SphereSphereAlgorithm::getAllContactManifolds(btManifoldArray& manifolds) {
  if (manifold_ != nullptr) manifolds.push_back(manifold_);
}

btCollisionAlgorithm* SphereSphereAlgorithm::CreateFunc::CreateCollisionAlgorithm(
    btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* body0,
    const btCollisionObjectWrapper* body1) {
  void* memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(SphereSphereAlgorithm));
  return new (memory) SphereSphereAlgorithm(info, body0, body1);
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
