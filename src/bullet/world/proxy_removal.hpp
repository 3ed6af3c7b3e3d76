/// Removal of an object from a broadphase, with the same results in the same order as in Bullet.
#pragma once

#include <jfpx/config.hpp>

#include "src/base/thread_pool.hpp"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// To remove one object, Bullet visits all pairs of the pair cache twice. This class searches them
/// once, in parallel.
class JFPX_BULLET_API ProxyRemoval {
 public:
  /// Has the effect of btCollisionWorld::removeCollisionObject() on the broadphase, the pair cache
  /// and the handle of the object. Returns false, without a change, for an object without a proxy,
  /// for another broadphase, pair cache or dispatcher, if user code may run during a removal, or
  /// without enough memory; Bullet must then remove the object.
  bool run(btCollisionWorld& world, btCollisionObject& object, ThreadPool& pool);

 private:
  bool find_pairs(const btBroadphasePairArray& pairs, const btBroadphaseProxy* proxy,
                  ThreadPool& pool);
  static void find_pairs(const btBroadphasePairArray& pairs, int first, int last,
                         const btBroadphaseProxy* proxy, std::vector<int>* found);
  void remove_pairs(btHashedOverlappingPairCache& cache, btDispatcher* dispatcher);

  std::vector<int> found_;               ///< indices of the pairs of the object, ascending
  std::vector<std::vector<int>> parts_;  ///< by chunk
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
