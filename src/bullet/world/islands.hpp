/// Equivalent of Bullet's island manager with the same results in the same order. It reads each
/// object and manifold once, where Bullet reads them in every comparison of a sort.
#pragma once

#include <jfpx/config.hpp>

#include "src/base/buffer.hpp"
#include "src/base/thread_pool.hpp"

#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>
#include <BulletCollision/CollisionDispatch/btSimulationIslandManager.h>
#include <BulletDynamics/ConstraintSolver/btConstraintSolver.h>

#include <vector>

class btTypedConstraint;

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// btSimulationIslandManager::updateActivationState(): numbers the movable objects, and unites
/// those whose AABBs overlap.
void number_and_unite(btCollisionWorld& world, btUnionFind* unions);
/// btSimulationIslandManager::storeIslandActivationState(): writes island tags to the objects.
void store_islands(btCollisionWorld& world, btUnionFind* unions);

/// Builds the islands of a world, and solves the awake ones in the same groups as Bullet.
class IslandSolver {
 public:
  explicit IslandSolver(ThreadPool& pool) : pool_(pool) {}

  /// Reserves all memory that solve() needs. @returns false if an allocation fails
  bool reserve_geometric(btCollisionWorld& world, int constraint_count) noexcept;
  /// @param constraints sorted by island
  void solve(btCollisionWorld& world, btUnionFind& unions, btConstraintSolver& solver,
             const btContactSolverInfo& info, btTypedConstraint** constraints,
             int constraint_count);

 private:
  /// Sort keys of manifolds; `index` refers to found_.
  struct IslandKey {
    int island, index;
  };
  struct PairKey {
    int island, uid0, uid1, index;
  };

  static void update_sleep(btCollisionObjectArray& objects, btUnionFind& unions);
  void collect_manifolds(btCollisionWorld& world);
  bool collect_in_parallel(btDispatcher& dispatcher, bool only_touching);
  void sort_manifolds(bool by_pair);
  void solve_awake(btCollisionWorld& world, btUnionFind& unions, btConstraintSolver& solver,
                   const btContactSolverInfo& info, btTypedConstraint** constraints,
                   int constraint_count);

  ThreadPool& pool_;
  btAlignedObjectArray<IslandKey> keys_;
  btAlignedObjectArray<PairKey> pair_keys_;
  Buffer<btPersistentManifold*> found_;  ///< manifolds to solve, in the dispatcher's order
  Buffer<int> found_island_;             ///< their islands
  std::vector<int> chunk_counts_;
  int count_ = 0;
  std::vector<btCollisionObject*> bodies_;
  std::vector<btPersistentManifold*> manifolds_;
  std::vector<btTypedConstraint*> constraints_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
