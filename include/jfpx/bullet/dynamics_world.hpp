/// Drop-in replacement for btDiscreteDynamicsWorld with bit-identical results.
#pragma once

#include <jfpx/build.hpp>
#include <jfpx/bullet/abi.hpp>

#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorld.h>

#include <cstddef>
#include <memory>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

struct DynamicsWorldOptions {
  unsigned threads = 1;           ///< 0: one per core, at most 256
  std::size_t minimum_batch = 0;  ///< with fewer non-static bodies, Bullet's own code runs
};

/// A btDiscreteDynamicsWorld that sorts manifolds by island with compact keys instead of through
/// pointers, runs the loops over bodies in parallel, and finds the overlapping pairs of a
/// btDbvtBroadphase, and those of an object to remove, in parallel. Pairs, groups, their order,
/// sleeping, velocities and transforms are those of btDiscreteDynamicsWorld, bit for bit. Motion
/// states are called by the thread that steps the world.
///
/// In steps with continuous collision of any body, bodies are integrated one at a time, because the
/// sweep of each body depends on the new positions of earlier bodies. All overrides and callbacks
/// work as in Bullet, with one exception: while islands are split, buildAndProcessIslands() of
/// Bullet's own island manager and the world's protected m_solverIslandCallback are not used. An
/// island manager of another class builds the islands itself. If user code that may change the
/// world can run during the update of the AABBs, Bullet's own code updates them.
///
/// Programs that include Bullet's headers need -ffp-contract=off, which linking jfpx::bullet adds.
/// As in Bullet, only one thread at a time may use a world; different worlds are independent.
class JFPX_BULLET_API DynamicsWorld : public btDiscreteDynamicsWorld {
 public:
  BT_DECLARE_ALIGNED_ALLOCATOR();

  /// As in Bullet, the caller owns the arguments. If `solver` is null, the world creates and owns a
  /// solver.
  /// @throws InvalidArgument for more than 256 threads.
  DynamicsWorld(btDispatcher* dispatcher, btBroadphaseInterface* broadphase,
                btConstraintSolver* solver, btCollisionConfiguration* configuration,
                const DynamicsWorldOptions& options = {});
  ~DynamicsWorld() override;
  DynamicsWorld(const DynamicsWorld&) = delete;
  DynamicsWorld& operator=(const DynamicsWorld&) = delete;

  void applyGravity() override;
  void clearForces() override;
  void synchronizeMotionStates() override;
  void updateAabbs() override;
  void computeOverlappingPairs() override;
  void solveConstraints(btContactSolverInfo& info) override;
  void removeCollisionObject(btCollisionObject* object) override;
  void removeRigidBody(btRigidBody* body) override;

  std::size_t minimum_batch() const noexcept;
  /// Must not be called during a step.
  void set_minimum_batch(std::size_t bodies) noexcept;

 protected:
  void predictUnconstraintMotion(btScalar dt) override;
  void createPredictiveContacts(btScalar dt) override;
  void calculateSimulationIslands() override;
  void integrateTransforms(btScalar dt) override;
  void updateActivationState(btScalar dt) override;

 private:
  bool is_small() const noexcept;
  bool has_stock_island_manager() const noexcept;

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
