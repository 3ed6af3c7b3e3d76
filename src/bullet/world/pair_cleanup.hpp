/// Removal of pairs that no longer overlap, with the same results in the same order as in Bullet.
#pragma once

#include <jfpx/config.hpp>

#include "src/base/thread_pool.hpp"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>

#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// In every step with changes, Bullet tests some or all pairs. The tests are independent and run in
/// parallel; the removals run serially.
class JFPX_BULLET_API PairCleanup {
 public:
  /// @param minimum_pairs with fewer pairs to test, Bullet's own code runs
  explicit PairCleanup(int minimum_pairs = 4096) : minimum_pairs_(minimum_pairs) {}

  /// Has the effect of btCollisionWorld::computeOverlappingPairs(). Returns false, without a
  /// change, for another broadphase, pair cache or dispatcher, if user code may run during a
  /// removal, if there are few pairs to test, or without enough memory; Bullet must then remove the
  /// pairs.
  bool run(btCollisionWorld& world, ThreadPool& pool);

 private:
  enum class State : std::uint8_t { overlaps, apart, unknown };

  bool test_pairs(const btBroadphasePairArray& pairs, int first, int count, ThreadPool& pool);
  int remove_pairs(btDbvtBroadphase& tree, btDispatcher* dispatcher, int count);

  int minimum_pairs_;
  std::vector<State> states_;  ///< by pair
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
