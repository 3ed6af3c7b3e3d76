/// Reads the table of a dispatcher, and observes which triangles Bullet ignores.
#include "src/bullet/dispatch/triangle_algorithms.hpp"

#include "src/bullet/dispatch/body_wrapper.hpp"
#include "src/bullet/exact_class.hpp"

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btConvexConcaveCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionDispatch/btSphereTriangleCollisionAlgorithm.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>

#include <new>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

struct DispatcherTable : btCollisionDispatcher {
  static constexpr auto functions() { return &DispatcherTable::m_doubleDispatchContactPoints; }
};

/// btMinkowskiPenetrationDepthSolver has state that threads share.
bool may_run_on_any_thread(const btCollisionAlgorithmCreateFunc& function) {
  if (!is_exactly<btConvexConvexAlgorithm::CreateFunc>(function)) return false;
  const btConvexPenetrationDepthSolver* solver =
      static_cast<const btConvexConvexAlgorithm::CreateFunc&>(function).m_pdSolver;
  return solver != nullptr && is_exactly<btGjkEpaPenetrationDepthSolver>(*solver);
}

/// An algorithm without an effect.
class NoAlgorithm final : public btCollisionAlgorithm {
 public:
  void processCollision(const btCollisionObjectWrapper*, const btCollisionObjectWrapper*,
                        const btDispatcherInfo&, btManifoldResult*) override {}
  btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                 btManifoldResult*) override {
    return 1;
  }
  void getAllContactManifolds(btManifoldArray&) override {}
};

/// Counts the triangles that a btConvexTriangleCallback does not ignore.
class CountingDispatcher final : public btDispatcher {
 public:
  int triangles() const { return triangles_; }

  btCollisionAlgorithm* findAlgorithm(const btCollisionObjectWrapper*,
                                      const btCollisionObjectWrapper*, btPersistentManifold*,
                                      ebtDispatcherQueryType) override {
    ++triangles_;
    return new (room_) NoAlgorithm();
  }
  btPersistentManifold* getNewManifold(const btCollisionObject*,
                                       const btCollisionObject*) override {
    return &manifold_;
  }
  void releaseManifold(btPersistentManifold*) override {}
  void clearManifold(btPersistentManifold*) override {}
  bool needsCollision(const btCollisionObject*, const btCollisionObject*) override { return true; }
  bool needsResponse(const btCollisionObject*, const btCollisionObject*) override { return true; }
  void dispatchAllCollisionPairs(btOverlappingPairCache*, const btDispatcherInfo&,
                                 btDispatcher*) override {}
  int getNumManifolds() const override { return 0; }
  btPersistentManifold* getManifoldByIndexInternal(int) override { return nullptr; }
  btPersistentManifold** getInternalManifoldPointer() override { return nullptr; }
  btPoolAllocator* getInternalManifoldPool() override { return nullptr; }
  const btPoolAllocator* getInternalManifoldPool() const override { return nullptr; }
  void* allocateCollisionAlgorithm(int) override { return room_; }
  void freeCollisionAlgorithm(void*) override {}

 private:
  int triangles_ = 0;
  alignas(16) unsigned char room_[sizeof(NoAlgorithm)];
  btPersistentManifold manifold_{nullptr, nullptr, 0, 0, 0};
};

/// Passes a triangle to Bullet whose plane is 0.2 away from a ball of radius 1, and whose box
/// overlaps that of the ball.
bool observe_separated_triangle() {
  CountingDispatcher dispatcher;
  btSphereShape ball(1), other(1);
  btCollisionObject a, b;
  a.setCollisionShape(&ball);
  b.setCollisionShape(&other);
  a.setWorldTransform(btTransform::getIdentity());
  b.setWorldTransform(btTransform::getIdentity());
  const btCollisionObjectWrapper wrapper_a = wrapper_of(a), wrapper_b = wrapper_of(b);
  btConvexTriangleCallback callback(&dispatcher, &wrapper_a, &wrapper_b, false);
  btManifoldResult result(&wrapper_a, &wrapper_b);
  const btDispatcherInfo info;
  callback.setTimeStepAndCounters(0, info, &wrapper_a, &wrapper_b, &result);
  constexpr btScalar kCorner = btScalar(2.08);  // 1.2 * sqrt(3)
  btVector3 triangle[] = {{kCorner, 0, 0}, {0, kCorner, 0}, {0, 0, kCorner}};
  callback.processTriangle(triangle, 0, 0);
  return dispatcher.triangles() == 0;
}

}  // namespace

bool TriangleAlgorithms::ignores_separated() {
  static const bool ignores = observe_separated_triangle();
  return ignores;
}

void TriangleAlgorithms::read(const btCollisionDispatcher& dispatcher) {
  const auto& table = dispatcher.*DispatcherTable::functions();
  const btCollisionAlgorithmCreateFunc* known = nullptr;  // of most types
  for (std::size_t type = 0; type < convex_.size(); ++type) {
    const btCollisionAlgorithmCreateFunc* function = table[type][TRIANGLE_SHAPE_PROXYTYPE];
    convex_[type] = nullptr;
    if (function == nullptr) continue;
    if (function != known && !may_run_on_any_thread(*function)) continue;
    known = function;
    convex_[type] = static_cast<const btConvexConvexAlgorithm::CreateFunc*>(function);
  }
  const btCollisionAlgorithmCreateFunc* sphere =
      table[SPHERE_SHAPE_PROXYTYPE][TRIANGLE_SHAPE_PROXYTYPE];
  has_stock_sphere_ = sphere != nullptr && !sphere->m_swapped &&
                      is_exactly<btSphereTriangleCollisionAlgorithm::CreateFunc>(*sphere);
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
