/// What a step does to the boxes of bodies in Bullet's dynamic tree, with the same results in the
/// same order, asking for memory ahead of its use.
#pragma once

#include <jfpx/config.hpp>

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// In large worlds more than half of Bullet's update goes into finding again, one after the other,
/// pairs that the hash table has since long: each takes several reads from memory.
class JFPX_API AabbUpdate {
 public:
  /// btCollisionWorld::updateAabbs(). False, and nothing is done, if the broadphase is not Bullet's
  /// own tree over Bullet's own hash table, as it is by default, if the user filters or hears of
  /// pairs or draws, or if there is no memory.
  bool run(btCollisionWorld& world);

 private:
  struct Pair {
    btDbvtProxy *a, *b;  ///< by ascending id
    bool swapped;        ///< `a` is the body that has moved
    int* slot;           ///< where a search in the hash table begins
    int index;           ///< into the pairs, of the first to compare with
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
