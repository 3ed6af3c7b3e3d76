/// Follows the cleanup in btDbvtBroadphase::collide() of Bullet 3.24.
#include "src/bullet/world/pair_cleanup.hpp"

#include "src/base/reserve.hpp"
#include "src/bullet/chunks.hpp"
#include "src/bullet/exact_class.hpp"
#include "src/bullet/prefetch.hpp"
#include "src/bullet/world/plain_dispatcher.hpp"
#include "src/bullet/world/plain_ghosts.hpp"

#include <BulletCollision/CollisionDispatch/btSphereSphereCollisionAlgorithm.h>
#include <LinearMath/btQuickprof.h>

#include <algorithm>
#include <atomic>
#include <new>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

constexpr std::size_t kCleanupPairsPerChunk = 2048;
/// Minimum number of pairs for several threads: below, waking threads takes longer.
constexpr std::size_t kSharedCleanupPairs = 8192;

bool is_apart(const btBroadphasePair& pair) {
  const auto* a = static_cast<const btDbvtProxy*>(pair.m_pProxy0);
  const auto* b = static_cast<const btDbvtProxy*>(pair.m_pProxy1);
  return !Intersect(a->leaf->volume, b->leaf->volume);
}

void prefetch_volumes(const btBroadphasePairArray& pairs, int i) {
  constexpr int kAhead = 8;
  if (i + 2 * kAhead < pairs.size()) {
    const btBroadphasePair& pair = pairs[i + 2 * kAhead];
    prefetch(&static_cast<const btDbvtProxy*>(pair.m_pProxy0)->leaf);
    prefetch(&static_cast<const btDbvtProxy*>(pair.m_pProxy1)->leaf);
  }
  if (i + kAhead < pairs.size()) {
    const btBroadphasePair& pair = pairs[i + kAhead];
    prefetch_ends(static_cast<const btDbvtProxy*>(pair.m_pProxy0)->leaf, sizeof(btDbvtVolume));
    prefetch_ends(static_cast<const btDbvtProxy*>(pair.m_pProxy1)->leaf, sizeof(btDbvtVolume));
  }
}

/// Prefetches the data for removals of pairs. Pairs to remove are few and far apart, so every
/// removal would wait for memory.
class RemovalPrefetch {
 public:
  RemovalPrefetch(btHashedOverlappingPairCache& cache, btDispatcher* dispatcher)
      : pairs_(cache.getOverlappingPairArray()),
        heads_(&(cache.*PairTables::heads)[0]),
        dispatcher_(dispatcher) {
    manifolds_.reserve(1);
  }

  /// For pair `i`, some time before its removal: its slot in the hash table, and its algorithm.
  void early(int i) const {
    const btBroadphasePair& pair = pairs_[i];
    const unsigned mask = static_cast<unsigned>(pairs_.capacity()) - 1;
    prefetch(heads_ + (pair_hash(pair.m_pProxy0->m_uniqueId, pair.m_pProxy1->m_uniqueId) & mask));
    if (pair.m_algorithm != nullptr) {
      prefetch_ends(pair.m_algorithm, sizeof(btSphereSphereCollisionAlgorithm));
    }
  }

  /// Later: the manifold of its algorithm.
  void late(int i) {
    btCollisionAlgorithm* algorithm = pairs_[i].m_algorithm;
    if (algorithm == nullptr || !is_exactly<btSphereSphereCollisionAlgorithm>(*algorithm)) return;
    manifolds_.resizeNoInitialize(0);
    algorithm->getAllContactManifolds(manifolds_);
    if (manifolds_.size() > 0) prefetch_header(manifolds_[0]);
  }

  /// Prefetches the last pairs and manifolds, which replace removed ones.
  void last() const {
    constexpr int kLast = 4;
    if (pairs_.size() > kLast) early(pairs_.size() - kLast);
    const int manifolds = dispatcher_->getNumManifolds();
    if (manifolds > kLast) {
      prefetch_header(dispatcher_->getInternalManifoldPointer()[manifolds - kLast]);
    }
  }

 private:
  const btBroadphasePairArray& pairs_;
  const int* heads_;
  btDispatcher* dispatcher_;
  btManifoldArray manifolds_;
};

/// Number of pairs that Bullet tests if none is removed.
int pairs_to_test(const btDbvtBroadphase& tree, int pairs) {
  return std::min(pairs, std::max(tree.m_newpairs, pairs * tree.m_cupdates / 100));
}

/// Bullet's update of the tree, without the cleanup.
void collide_without_cleanup(btDbvtBroadphase& tree, btDispatcher* dispatcher) {
  const int percentage = tree.m_cupdates, position = tree.m_cid;
  tree.m_newpairs = tree.m_cupdates = 0;
  tree.calculateOverlappingPairs(dispatcher);
  tree.m_cupdates = percentage;
  tree.m_cid = position;  // may exceed the number of pairs, which matters after a removal
}

}  // namespace

bool PairCleanup::run(btCollisionWorld& world, ThreadPool& pool) {
  btBroadphaseInterface& broadphase = *world.getBroadphase();
  btDispatcher* dispatcher = world.getDispatcher();
  if (!is_exactly<btDbvtBroadphase>(broadphase) || dispatcher == nullptr) return false;
  auto& tree = static_cast<btDbvtBroadphase&>(broadphase);
  if (!is_exactly<btHashedOverlappingPairCache>(*tree.m_paircache)) return false;
  auto& cache = static_cast<btHashedOverlappingPairCache&>(*tree.m_paircache);
  if (tree.m_deferedcollide) return false;
  if (!is_plain(*dispatcher) || gContactDestroyedCallback != nullptr ||
      gContactEndedCallback != nullptr) {
    return false;
  }
  const int next_stage = (tree.m_stageCurrent + 1) % btDbvtBroadphase::STAGECOUNT;
  const bool needed = tree.m_needcleanup || tree.m_stageRoots[next_stage] != nullptr;
  const int size = cache.getOverlappingPairArray().size(), count = pairs_to_test(tree, size);
  if (!needed || count < std::max(1, minimum_pairs_)) return false;
  if (!has_plain_ghosts(world, cache)) return false;
  try {
    assign_geometric(&states_, static_cast<std::size_t>(size), State::unknown);
  } catch (const std::bad_alloc&) {
    return false;
  }

  BT_PROFILE("calculateOverlappingPairs");  // Bullet's name of the profile zone
  collide_without_cleanup(tree, dispatcher);
  if (!test_pairs(cache.getOverlappingPairArray(), tree.m_cid % size, count, pool)) {
    tree.m_cid = (tree.m_cid + count) % size;
    return true;
  }
  const int tested = remove_pairs(tree, dispatcher, count);
  const int left = cache.getOverlappingPairArray().size();
  tree.m_cid = left > 0 ? (tree.m_cid + tested) % left : 0;
  return true;
}

/// Tests the pairs from `first` on, cyclically. Returns false if all overlap.
bool PairCleanup::test_pairs(const btBroadphasePairArray& pairs, int first, int count,
                             ThreadPool& pool) {
  const int size = pairs.size();
  std::atomic<bool> any{false};
  const auto tested = static_cast<std::size_t>(count);
  const std::size_t chunk = chunk_size(tested, kCleanupPairsPerChunk, kSharedCleanupPairs);
  in_chunks(pool, tested, chunk, [&](std::size_t begin, std::size_t end) {
    bool found = false;
    for (auto k = static_cast<int>(begin); k < static_cast<int>(end); ++k) {
      const int i = first + k < size ? first + k : first + k - size;
      prefetch_volumes(pairs, i);
      const bool apart = is_apart(pairs[i]);
      states_[static_cast<std::size_t>(i)] = apart ? State::apart : State::overlaps;
      found |= apart;
    }
    if (found) any.store(true, std::memory_order_relaxed);
  });
  return any;
}

/// Removes pairs in Bullet's order. The last pair replaces a removed pair and is tested next.
/// @return the number of pairs that were tested and kept
int PairCleanup::remove_pairs(btDbvtBroadphase& tree, btDispatcher* dispatcher, int count) {
  const btBroadphasePairArray& pairs = tree.m_paircache->getOverlappingPairArray();
  RemovalPrefetch ahead(static_cast<btHashedOverlappingPairCache&>(*tree.m_paircache), dispatcher);
  const auto state_of = [&](int i) -> State& { return states_[static_cast<std::size_t>(i)]; };
  constexpr int kEarly = 128, kLate = 64;  // one pair in a hundred is removed
  int i = pairs.size() > 0 ? tree.m_cid % pairs.size() : 0;
  for (int kept = 0; kept < count;) {
    if (state_of(i) == State::overlaps || (state_of(i) == State::unknown && !is_apart(pairs[i]))) {
      ++kept;
      if (i + kEarly < pairs.size() && state_of(i + kEarly) == State::apart)
        ahead.early(i + kEarly);
      if (i + kLate < pairs.size() && state_of(i + kLate) == State::apart) ahead.late(i + kLate);
      if (++i == pairs.size()) i = 0;
      continue;
    }
    tree.m_paircache->removeOverlappingPair(pairs[i].m_pProxy0, pairs[i].m_pProxy1, dispatcher);
    state_of(i) = state_of(pairs.size());
    --count;
    ahead.last();
    if (pairs.size() > 0) i = (tree.m_cid + kept) % pairs.size();
  }
  return count;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
