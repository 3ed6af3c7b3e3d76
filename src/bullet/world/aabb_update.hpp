/// Update of the AABBs in Bullet's dynamic tree, with the same results in the same order, and with
/// software prefetching.
#pragma once

#include <jfpx/config.hpp>

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// In large worlds, Bullet spends more than half of the update on finding pairs that are already in
/// the hash table, one after the other; each takes several reads from memory.
class JFPX_API AabbUpdate {
 public:
  /// Has the effect of btCollisionWorld::updateAabbs(). Returns false and changes nothing if the
  /// broadphase is not Bullet's default, its own tree with its own hash table, if a pair filter, a
  /// ghost pair callback or a debug drawer is set, or if there is not enough memory.
  bool run(btCollisionWorld& world);

 private:
  struct Pair {
    btDbvtProxy *a, *b;  ///< by ascending id
    bool swapped;        ///< `a` is the body that has moved
    int* slot;           ///< the hash table's slot of the pair
    int index;           ///< index of the first pair to compare with
  };

  bool reserve_geometric(std::size_t leaves) noexcept;
  void find_overlaps(const btDbvtNode* root, const btDbvtNode* leaf);
  void add_pairs(btHashedOverlappingPairCache& cache);

  std::vector<const btDbvtNode*> stack_;
  std::vector<Pair> pairs_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
