/// What Bullet's island manager does, with the same results in the same order, reading each object
/// and manifold once where it reads them for every comparison of a sort.
#pragma once

#include <jfpx/config.hpp>

#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>
#include <BulletCollision/CollisionDispatch/btSimulationIslandManager.h>
#include <BulletDynamics/ConstraintSolver/btConstraintSolver.h>

#include <vector>

class btTypedConstraint;

namespace jfpx::inline JFPX_ABI::bullet {

/// btSimulationIslandManager::updateActivationState(): numbers the movable objects, and unites
/// those whose boxes overlap.
void number_and_unite(btCollisionWorld& world, btUnionFind* unions);
/// btSimulationIslandManager::storeIslandActivationState(): tells objects their islands.
void store_islands(btCollisionWorld& world, btUnionFind* unions);

/// Builds the islands of a world, and solves those that are awake in groups as Bullet forms them.
class IslandSolver {
 public:
  /// @param constraints sorted by island
  void solve(btCollisionWorld& world, btUnionFind& unions, btConstraintSolver& solver,
             const btContactSolverInfo& info, btTypedConstraint** constraints,
             int constraint_count);

 private:
  struct Key {
    int island, uid0, uid1;
    btPersistentManifold* manifold;
  };

  void update_sleep(btCollisionObjectArray& objects, btUnionFind& unions);
  void collect_manifolds(btCollisionWorld& world);
  void solve_awake(btCollisionWorld& world, btUnionFind& unions, btConstraintSolver& solver,
                   const btContactSolverInfo& info, btTypedConstraint** constraints,
                   int constraint_count);

  btAlignedObjectArray<Key> keys_;
  std::vector<btCollisionObject*> bodies_;
  std::vector<btPersistentManifold*> manifolds_;
  std::vector<btTypedConstraint*> constraints_;
};

}  // namespace jfpx::inline JFPX_ABI::bullet
