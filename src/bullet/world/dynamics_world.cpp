/// The stages of a step of a dynamics world.
#include <jfpx/bullet/dynamics_world.hpp>
#include <jfpx/error.hpp>

#include "src/base/thread_pool.hpp"
#include "src/bullet/chunks.hpp"
#include "src/bullet/exact_class.hpp"
#include "src/bullet/world/aabb_update.hpp"
#include "src/bullet/world/islands.hpp"
#include "src/bullet/world/pair_cleanup.hpp"
#include "src/bullet/world/proxy_removal.hpp"

#include <BulletDynamics/ConstraintSolver/btTypedConstraint.h>
#include <LinearMath/btQuickprof.h>

#include <algorithm>
#include <atomic>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

constexpr std::size_t kBodiesPerChunk = 64;
/// Minimum number of bodies for several threads: below, waking threads takes longer.
constexpr std::size_t kSharedBodies = 2048;

int island_of(const btTypedConstraint* constraint) {
  const int tag = constraint->getRigidBodyA().getIslandTag();
  return tag >= 0 ? tag : constraint->getRigidBodyB().getIslandTag();
}
bool is_movable(const btCollisionObject& object) { return !object.isStaticOrKinematicObject(); }

/// Equals btDiscreteDynamicsWorld::updateActivationState().
void update_activation(btRigidBody& body, btScalar dt) {
  body.updateDeactivation(dt);
  if (!body.wantsSleeping()) {
    if (body.getActivationState() != DISABLE_DEACTIVATION) body.setActivationState(ACTIVE_TAG);
  } else if (!is_movable(body)) {
    body.setActivationState(ISLAND_SLEEPING);
  } else if (body.getActivationState() == ACTIVE_TAG) {
    body.setActivationState(WANTS_DEACTIVATION);
  } else if (body.getActivationState() == ISLAND_SLEEPING) {
    body.setAngularVelocity(btVector3(0, 0, 0));
    body.setLinearVelocity(btVector3(0, 0, 0));
  }
}

}  // namespace

struct DynamicsWorld::Impl {
  ThreadPool pool;
  IslandSolver islands;
  AabbUpdate boxes;
  PairCleanup cleanup;
  ProxyRemoval removal;
  std::size_t minimum_batch;

  explicit Impl(const DynamicsWorldOptions& options)
      : pool(options.threads), islands(pool), minimum_batch(options.minimum_batch) {}

  /// Calls run(bodies, count) for all chunks of the array; in parallel for many bodies.
  template <class Run>
  void in_body_chunks(btAlignedObjectArray<btRigidBody*>& bodies, const Run& run) {
    const auto count = static_cast<std::size_t>(bodies.size());
    in_chunks(pool, count, chunk_size(count, kBodiesPerChunk, kSharedBodies),
              [&](std::size_t first, std::size_t last) {
                run(&bodies[static_cast<int>(first)], static_cast<int>(last - first));
              });
  }
  template <class Predicate>
  bool any_body(btAlignedObjectArray<btRigidBody*>& bodies, const Predicate& predicate) {
    std::atomic<bool> found{false};
    in_body_chunks(bodies, [&](btRigidBody** part, int count) {
      if (std::any_of(part, part + count, predicate)) found.store(true, std::memory_order_relaxed);
    });
    return found;
  }
  /// Whether continuous collision may shorten the path of any body.
  bool has_swept_bodies(btAlignedObjectArray<btRigidBody*>& bodies, const btDispatcherInfo& info) {
    return info.m_useContinuous && any_body(bodies, [](const btRigidBody* body) {
             return body->getCcdSquareMotionThreshold() != 0;
           });
  }
};

DynamicsWorld::DynamicsWorld(btDispatcher* dispatcher, btBroadphaseInterface* broadphase,
                             btConstraintSolver* solver, btCollisionConfiguration* configuration,
                             const DynamicsWorldOptions& options)
    : btDiscreteDynamicsWorld(dispatcher, broadphase, solver, configuration),
      impl_(std::make_unique<Impl>(options)) {}
DynamicsWorld::~DynamicsWorld() = default;

std::size_t DynamicsWorld::minimum_batch() const noexcept { return impl_->minimum_batch; }
void DynamicsWorld::set_minimum_batch(std::size_t bodies) noexcept {
  impl_->minimum_batch = bodies;
}
bool DynamicsWorld::is_small() const noexcept {
  return static_cast<std::size_t>(m_nonStaticRigidBodies.size()) < impl_->minimum_batch;
}

void DynamicsWorld::applyGravity() {
  if (is_small()) {
    btDiscreteDynamicsWorld::applyGravity();
    return;
  }
  impl_->in_body_chunks(m_nonStaticRigidBodies, [](btRigidBody** bodies, int count) {
    for (int i = 0; i < count; ++i) {
      if (bodies[i]->isActive()) bodies[i]->applyGravity();
    }
  });
}

void DynamicsWorld::clearForces() {
  if (is_small()) {
    btDiscreteDynamicsWorld::clearForces();
    return;
  }
  impl_->in_body_chunks(m_nonStaticRigidBodies, [](btRigidBody** bodies, int count) {
    for (int i = 0; i < count; ++i) bodies[i]->clearForces();
  });
}

// A motion state may have a user-defined class.
void DynamicsWorld::synchronizeMotionStates() {
  if (is_small() || m_synchronizeAllMotionStates ||
      impl_->any_body(m_nonStaticRigidBodies, [](const btRigidBody* body) {
        return body->getMotionState() != nullptr && body->isActive();
      })) {
    btDiscreteDynamicsWorld::synchronizeMotionStates();
  }
}

void DynamicsWorld::updateActivationState(btScalar dt) {
  if (is_small()) {
    btDiscreteDynamicsWorld::updateActivationState(dt);
    return;
  }
  BT_PROFILE("updateActivationState");
  impl_->in_body_chunks(m_nonStaticRigidBodies, [&](btRigidBody** bodies, int count) {
    for (int i = 0; i < count; ++i) update_activation(*bodies[i], dt);
  });
}

void DynamicsWorld::predictUnconstraintMotion(btScalar dt) {
  if (is_small()) {
    btDiscreteDynamicsWorld::predictUnconstraintMotion(dt);
    return;
  }
  BT_PROFILE("predictUnconstraintMotion");
  impl_->in_body_chunks(m_nonStaticRigidBodies, [&](btRigidBody** bodies, int count) {
    for (int i = 0; i < count; ++i) {
      if (!is_movable(*bodies[i])) continue;
      bodies[i]->applyDamping(dt);
      bodies[i]->predictIntegratedTransform(dt, bodies[i]->getInterpolationWorldTransform());
    }
  });
}

void DynamicsWorld::createPredictiveContacts(btScalar dt) {
  if (is_small() || impl_->has_swept_bodies(m_nonStaticRigidBodies, getDispatchInfo())) {
    btDiscreteDynamicsWorld::createPredictiveContacts(dt);
    return;
  }
  BT_PROFILE("createPredictiveContacts");
  releasePredictiveContacts();
  impl_->in_body_chunks(m_nonStaticRigidBodies, [&](btRigidBody** bodies, int count) {
    for (int i = 0; i < count; ++i) bodies[i]->setHitFraction(1);
  });
}

void DynamicsWorld::integrateTransforms(btScalar dt) {
  if (is_small() || m_applySpeculativeContactRestitution ||
      impl_->has_swept_bodies(m_nonStaticRigidBodies, getDispatchInfo())) {
    btDiscreteDynamicsWorld::integrateTransforms(dt);
    return;
  }
  BT_PROFILE("integrateTransforms");
  impl_->in_body_chunks(m_nonStaticRigidBodies, [&](btRigidBody** bodies, int count) {
    integrateTransformsInternal(bodies, count, dt);
  });
}

void DynamicsWorld::updateAabbs() {
  if (is_small() || !impl_->boxes.run(*this, impl_->pool)) btDiscreteDynamicsWorld::updateAabbs();
}

void DynamicsWorld::computeOverlappingPairs() {
  if (is_small() || !impl_->cleanup.run(*this, impl_->pool)) {
    btDiscreteDynamicsWorld::computeOverlappingPairs();
  }
}

// For an object without a proxy, Bullet's functions have no effect on the broadphase.
void DynamicsWorld::removeCollisionObject(btCollisionObject* object) {
  if (!is_small()) impl_->removal.run(*this, *object, impl_->pool);
  btDiscreteDynamicsWorld::removeCollisionObject(object);
}

void DynamicsWorld::removeRigidBody(btRigidBody* body) {
  if (!is_small()) impl_->removal.run(*this, *body, impl_->pool);
  btDiscreteDynamicsWorld::removeRigidBody(body);
}

bool DynamicsWorld::has_stock_island_manager() const noexcept {
  return m_islandManager != nullptr && is_exactly<btSimulationIslandManager>(*m_islandManager);
}

void DynamicsWorld::calculateSimulationIslands() {
  if (is_small() || !has_stock_island_manager() || !impl_->islands.reserve_for_unions(*this)) {
    btDiscreteDynamicsWorld::calculateSimulationIslands();
    return;
  }
  BT_PROFILE("calculateSimulationIslands");
  btUnionFind& unions = getSimulationIslandManager()->getUnionFind();
  impl_->islands.number_and_unite(*this, &unions);
  const auto unite = [&](const btCollisionObject& a, const btCollisionObject& b) {
    if (is_movable(a) && is_movable(b)) unions.unite(a.getIslandTag(), b.getIslandTag());
  };
  for (int i = 0; i < m_predictiveManifolds.size(); ++i) {
    unite(*m_predictiveManifolds[i]->getBody0(), *m_predictiveManifolds[i]->getBody1());
  }
  for (int i = 0; i < m_constraints.size(); ++i) {
    if (!m_constraints[i]->isEnabled()) continue;
    unite(m_constraints[i]->getRigidBodyA(), m_constraints[i]->getRigidBodyB());
  }
  impl_->islands.store_islands(*this, &unions);
}

void DynamicsWorld::solveConstraints(btContactSolverInfo& info) {
  btSimulationIslandManager& manager = *getSimulationIslandManager();
  if (is_small() || !has_stock_island_manager() || !manager.getSplitIslands() ||
      !impl_->islands.reserve_geometric(*this, m_constraints.size())) {
    btDiscreteDynamicsWorld::solveConstraints(info);
    return;
  }
  BT_PROFILE("solveConstraints");
  m_sortedConstraints.copyFromArray(m_constraints);
  m_sortedConstraints.quickSort([](const btTypedConstraint* l, const btTypedConstraint* r) {
    return island_of(l) < island_of(r);
  });
  m_constraintSolver->prepareSolve(getNumCollisionObjects(), getDispatcher()->getNumManifolds());
  impl_->islands.solve(*this, manager.getUnionFind(), *m_constraintSolver, info,
                       m_sortedConstraints.size() > 0 ? &m_sortedConstraints[0] : nullptr,
                       m_sortedConstraints.size());
  m_constraintSolver->allSolved(info, getDebugDrawer());
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
