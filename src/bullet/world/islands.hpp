/// Equivalent of Bullet's island manager with the same results in the same order. It reads each
/// object and manifold once; Bullet reads them in every comparison of a sort.
#pragma once

#include <jfpx/config.hpp>

#include "src/base/buffer.hpp"
#include "src/base/thread_pool.hpp"
#include "src/bullet/solver/group_batch.hpp"

#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>
#include <BulletCollision/CollisionDispatch/btSimulationIslandManager.h>
#include <BulletDynamics/ConstraintSolver/btConstraintSolver.h>

#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Builds the islands of a world, and solves the awake ones in the same groups as Bullet.
class IslandSolver {
 public:
  /// @param pairs_per_round number of pairs that are compared in parallel with the same islands
  explicit IslandSolver(ThreadPool& pool, std::size_t pairs_per_round = std::size_t{1} << 17)
      : pool_(pool), pairs_per_round_(pairs_per_round) {}

  /// Reserves all memory for the next two functions. @returns false if an allocation fails
  bool reserve_for_unions(btCollisionWorld& world) noexcept;
  /// btSimulationIslandManager::updateActivationState(): numbers the movable objects, and unites
  /// objects whose AABBs overlap.
  void number_and_unite(btCollisionWorld& world, btUnionFind* unions);
  /// btSimulationIslandManager::storeIslandActivationState(): writes island tags to the objects.
  void store_islands(btCollisionWorld& world, btUnionFind* unions);

  /// Reserves all memory for solve(). @returns false if an allocation fails
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
  /// Two objects to unite, by number.
  struct Edge {
    int a, b;
  };
  struct GroupSizes {
    std::size_t bodies, manifolds, constraints;
  };
  struct PairKey {
    int island, uid0, uid1, index;
  };

  template <class Run>
  void in_object_chunks(const btCollisionObjectArray& objects, const Run& run);
  void number_objects(btCollisionObjectArray& objects);
  int find_edges(std::span<const btBroadphasePair> pairs, const btUnionFind& unions);
  static bool update_sleep(btCollisionObjectArray& objects, btUnionFind& unions);
  void collect_manifolds(btCollisionWorld& world);
  bool collect_in_parallel(btDispatcher& dispatcher, bool only_touching);
  void sort_islands(btUnionFind& unions);
  void sort_manifolds(bool by_pair);
  void add_manifolds(int first, int last);
  void solve_awake(btCollisionWorld& world, btUnionFind& unions, btConstraintSolver& solver,
                   const btContactSolverInfo& info, btTypedConstraint** constraints,
                   int constraint_count);

  ThreadPool& pool_;
  std::size_t pairs_per_round_;
  std::vector<int> numbers_;  ///< by chunk of objects: number of the first movable one
  Buffer<Edge> edges_;
  btAlignedObjectArray<IslandKey> keys_;
  btAlignedObjectArray<PairKey> pair_keys_;
  Buffer<btPersistentManifold*> found_;  ///< manifolds to solve, in the dispatcher's order
  Buffer<int> found_island_;             ///< their islands
  std::vector<int> chunk_counts_;
  int count_ = 0;
  std::vector<SolverGroup> groups_;  ///< refer to the lists below, which do not grow meanwhile
  std::vector<btCollisionObject*> bodies_;
  std::vector<btPersistentManifold*> manifolds_;
  std::vector<btTypedConstraint*> constraints_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
