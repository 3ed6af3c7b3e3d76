/// A part of a user's program that is compiled with -fno-rtti and derives from Bullet's classes.
#include "tests/bullet/no_rtti_unit.hpp"

#include <BulletCollision/CollisionDispatch/btSphereSphereCollisionAlgorithm.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>

#include <new>
#include <utility>

namespace jfpx::test {
namespace {

class Dispatcher final : public btCollisionDispatcher {
 public:
  using btCollisionDispatcher::btCollisionDispatcher;
  bool needsCollision(const btCollisionObject* a, const btCollisionObject* b) override {
    return btCollisionDispatcher::needsCollision(a, b);
  }
};

class PairCache final : public btHashedOverlappingPairCache {
 public:
  btBroadphasePair* addOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b) override {
    return btHashedOverlappingPairCache::addOverlappingPair(a, b);
  }
};

class Broadphase final : public btDbvtBroadphase {
 public:
  explicit Broadphase(std::unique_ptr<PairCache> cache)
      : btDbvtBroadphase(cache.get()), cache_(std::move(cache)) {}
  ~Broadphase() override { m_paircache = nullptr; }
  void calculateOverlappingPairs(btDispatcher* dispatcher) override {
    btDbvtBroadphase::calculateOverlappingPairs(dispatcher);
  }

 private:
  std::unique_ptr<PairCache> cache_;
};

// Not derived from the CreateFunc of btSphereSphereCollisionAlgorithm, whose vtable this unit would
// then provide, without type_info, to the whole program.
struct CreateFunction final : btCollisionAlgorithmCreateFunc {
  btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                 const btCollisionObjectWrapper* a,
                                                 const btCollisionObjectWrapper* b) override {
    void* memory =
        info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(btSphereSphereCollisionAlgorithm));
    return new (memory) btSphereSphereCollisionAlgorithm(nullptr, info, a, b);
  }
};

class Body final : public btRigidBody {
 public:
  using btRigidBody::btRigidBody;
  bool checkCollideWithOverride(const btCollisionObject* other) const override {
    return other->getUserIndex() % 7 != 0;
  }
};

class Sphere final : public btSphereShape {
 public:
  using btSphereShape::btSphereShape;
  btScalar getMargin() const override { return btSphereShape::getMargin(); }
};

}  // namespace

std::unique_ptr<btCollisionDispatcher> make_no_rtti_dispatcher(btCollisionConfiguration* c) {
  return std::make_unique<Dispatcher>(c);
}
std::unique_ptr<btBroadphaseInterface> make_no_rtti_broadphase() {
  return std::make_unique<Broadphase>(std::make_unique<PairCache>());
}
std::unique_ptr<btCollisionAlgorithmCreateFunc> make_no_rtti_create_function() {
  return std::make_unique<CreateFunction>();
}
std::unique_ptr<btRigidBody> make_no_rtti_body(btCollisionShape* shape) {
  btVector3 inertia;
  shape->calculateLocalInertia(1, inertia);
  auto body = std::make_unique<Body>(1, nullptr, shape, inertia);
  body->setIgnoreCollisionCheck(nullptr, true);  // enables the override
  return body;
}
btCollisionShape* make_no_rtti_sphere(btScalar radius) { return new Sphere(radius); }

}  // namespace jfpx::test
