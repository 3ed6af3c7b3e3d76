/// The dynamics world that puts jfpx into a Bullet program: one line changes, every bit stays.
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
  Build headers = Build::of_these_headers;  ///< leave it: what the caller includes
  unsigned threads = 1;                     ///< 0: one per core, at most 256
  std::size_t minimum_batch = 0;  ///< bodies below which a step is left to Bullet's own code
};

/// A btDiscreteDynamicsWorld whose islands are sorted by compact keys instead of through pointers,
/// whose bodies are predicted and integrated in parallel, and which finds the overlapping pairs of
/// a btDbvtBroadphase again without waiting for each. Pairs, groups, their order, sleeping,
/// velocities and transforms are those of btDiscreteDynamicsWorld, bit for bit.
///
/// In steps with continuous collision of some body, bodies are integrated one by one, because each
/// sees those before it at their new places. What users may override or call is as in Bullet; while
/// islands are split, buildAndProcessIslands() of Bullet's own island manager and the world's
/// protected m_solverIslandCallback are not used. Islands of another manager are left to it, and
/// boxes to Bullet while there is a debug drawer or a ghost pair callback, which may change the
/// world.
///
/// Programs that include Bullet's headers need -ffp-contract=off, which linking jfpx::bullet adds.
/// As in Bullet, one thread at a time; different worlds are independent.
class JFPX_API DynamicsWorld : public btDiscreteDynamicsWorld {
 public:
  BT_DECLARE_ALIGNED_ALLOCATOR();

  /// As Bullet's: the parts are the caller's, but a null solver becomes one that the world owns.
  /// @throws InvalidArgument for more than 256 threads; BuildMismatch (build.hpp).
  DynamicsWorld(btDispatcher* dispatcher, btBroadphaseInterface* broadphase,
                btConstraintSolver* solver, btCollisionConfiguration* configuration,
                const DynamicsWorldOptions& options = {});
  ~DynamicsWorld() override;
  DynamicsWorld(const DynamicsWorld&) = delete;
  DynamicsWorld& operator=(const DynamicsWorld&) = delete;

  void updateAabbs() override;
  void solveConstraints(btContactSolverInfo& info) override;

  std::size_t minimum_batch() const noexcept;
  /// Not within a step.
  void set_minimum_batch(std::size_t bodies) noexcept;

 protected:
  void predictUnconstraintMotion(btScalar dt) override;
  void createPredictiveContacts(btScalar dt) override;
  void calculateSimulationIslands() override;
  void integrateTransforms(btScalar dt) override;

 private:
  bool is_small() const noexcept;
  bool has_bullets_islands() const noexcept;

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
