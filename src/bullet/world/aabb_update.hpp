/// Update of the AABBs in Bullet's dynamic tree, with the same results in the same order.
#pragma once

#include <jfpx/config.hpp>

#include "src/base/thread_pool.hpp"
#include "src/bullet/world/leaf_update.hpp"
#include "src/bullet/world/overlap_search.hpp"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>

#include <atomic>
#include <cstddef>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// In large worlds, most time of the update is spent in the search for overlaps, and most of that
/// in looking up pairs that are already in the hash table. Only the shape of the tree depends on
/// the order of the objects. New volumes, overlaps and new pairs are therefore computed in
/// parallel. Then the leaves are moved one after the other, and the new pairs of each leaf are
/// added in Bullet's order.
class JFPX_BULLET_API AabbUpdate {
 public:
  /// @param minimum_objects fewer objects are updated serially, which is then faster
  explicit AabbUpdate(int minimum_objects = 256) : minimum_objects_(minimum_objects) {}

  /// Has the effect of btCollisionWorld::updateAabbs(). Returns false, without a change, if the
  /// broadphase is not Bullet's default (its own tree with its own hash table), if user code may
  /// run during the update (a pair filter, ghosts or shapes of a user class, a debug drawer in a
  /// small world or with an AABB that is too large), or if there is not enough memory.
  bool run(btCollisionWorld& world, ThreadPool& pool);

 private:
  struct NewPair {
    btDbvtProxy *other, *moved;
  };
  struct Pair {
    btDbvtProxy *a, *b;  ///< by ascending id
    bool swapped;        ///< `a` is the body that has moved
    const int* slot;     ///< the hash table's slot of the pair
    int index;           ///< index of the first pair to compare with
  };

  bool reserve_geometric(std::size_t leaves) noexcept;
  bool compute_updates(btCollisionWorld& world, btDbvtBroadphase& tree, ThreadPool& pool);
  bool few_leaves_move(const ThreadPool& pool);
  void run_in_tree(btDbvtBroadphase& tree, btHashedOverlappingPairCache& cache);
  bool run_in_parallel(btDbvtBroadphase& tree, btHashedOverlappingPairCache& cache,
                       ThreadPool& pool);
  bool adds_without_allocation(btHashedOverlappingPairCache& cache) const;
  void move_leaves(btDbvtBroadphase& tree);
  void add_new_pairs(btHashedOverlappingPairCache& cache);
  void run_one_by_one(btCollisionWorld& world, btDbvtBroadphase& tree,
                      btHashedOverlappingPairCache& cache);
  void search_tree(btDbvtBroadphase& tree, btHashedOverlappingPairCache& cache,
                   const btDbvtProxy& moved);
  void find_overlaps(const btDbvtNode* root, const btDbvtNode* leaf);
  void add_pairs(btHashedOverlappingPairCache& cache);

  int minimum_objects_;
  bool calm_ = false;  ///< few leaves moved in the last update; one by one is then faster
  std::vector<LeafUpdate> leaves_;
  OverlapSearch search_;
  std::vector<NewPair> new_pairs_;  ///< in Bullet's order, up to `ordered_`
  std::atomic<std::size_t> ordered_{0};
  std::atomic<bool> failed_{false};  ///< whether moving the leaves has thrown an exception
  std::vector<const btDbvtNode*> stack_;
  std::vector<Pair> pairs_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
