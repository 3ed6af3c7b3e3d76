/// What Bullet's island manager does, with the same results in the same order, reading each object
/// and manifold once where it reads them for every comparison of a sort.
#pragma once

#include <jfpx/config.hpp>

#include "src/x86/buffer.hpp"
#include "src/x86/thread_pool.hpp"

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
  explicit IslandSolver(x86::ThreadPool& pool) : pool_(pool) {}

  /// Takes all memory that solve() will need. @returns false if it can't be had
  bool make_room(btCollisionWorld& world, int constraint_count) noexcept;
  /// @param constraints sorted by island
  void solve(btCollisionWorld& world, btUnionFind& unions, btConstraintSolver& solver,
             const btContactSolverInfo& info, btTypedConstraint** constraints,
             int constraint_count);

 private:
  /// What manifolds are sorted by; `index` is into found_.
  struct IslandKey {
    int island, index;
  };
  struct PairKey {
    int island, uid0, uid1, index;
  };

  static void update_sleep(btCollisionObjectArray& objects, btUnionFind& unions);
  void collect_manifolds(btCollisionWorld& world);
  bool collect_at_once(btDispatcher& dispatcher, bool only_touching);
  void sort_manifolds(bool by_pair);
  void solve_awake(btCollisionWorld& world, btUnionFind& unions, btConstraintSolver& solver,
                   const btContactSolverInfo& info, btTypedConstraint** constraints,
                   int constraint_count);

  x86::ThreadPool& pool_;
  btAlignedObjectArray<IslandKey> keys_;
  btAlignedObjectArray<PairKey> pair_keys_;
  x86::Buffer<btPersistentManifold*> found_;  ///< manifolds to solve, in the dispatcher's order
  x86::Buffer<int> found_island_;             ///< their islands
  std::vector<int> chunk_counts_;
  int count_ = 0;
  std::vector<btCollisionObject*> bodies_;
  std::vector<btPersistentManifold*> manifolds_;
  std::vector<btTypedConstraint*> constraints_;
};

}  // namespace jfpx::inline JFPX_ABI::bullet
