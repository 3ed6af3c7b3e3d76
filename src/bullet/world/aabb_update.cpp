/// Reproduces btDbvtBroadphase and btHashedOverlappingPairCache of Bullet 3.24.
#include "src/bullet/world/aabb_update.hpp"

#include "src/base/reserve.hpp"
#include "src/bullet/exact_class.hpp"
#include "src/bullet/prefetch.hpp"

#include <LinearMath/btQuickprof.h>

#include <new>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// Pointers to the protected tables of a pair cache.
struct PairTables : btHashedOverlappingPairCache {
  static constexpr auto heads = &PairTables::m_hashTable;
  static constexpr auto next = &PairTables::m_next;
  static constexpr auto ghosts = &PairTables::m_ghostPairCallback;
};

/// Copy of the cache's hash function, which is private. If it differed, the results would be the
/// same, but Bullet would search for every pair.
unsigned hash_of(int id0, int id1) {
  unsigned key = static_cast<unsigned>(id0) | (static_cast<unsigned>(id1) << 16);
  key += ~(key << 15);
  key ^= key >> 10;
  key += key << 3;
  key ^= key >> 6;
  key += ~(key << 11);
  key ^= key >> 16;
  return key;
}

/// Defers the tree's search for overlaps to the caller. The tree requests the search by setting its
/// cleanup flag.
class DeferredSearch {
 public:
  explicit DeferredSearch(btDbvtBroadphase& tree) : tree_(tree) { tree_.m_deferedcollide = true; }
  ~DeferredSearch() {
    tree_.m_deferedcollide = false;
    tree_.m_needcleanup |= cleanup_;
  }
  DeferredSearch(const DeferredSearch&) = delete;
  DeferredSearch& operator=(const DeferredSearch&) = delete;

  template <class Update>
  bool needed_after(const Update& update) {
    cleanup_ |= tree_.m_needcleanup;
    tree_.m_needcleanup = false;
    update();
    return tree_.m_needcleanup;
  }

 private:
  btDbvtBroadphase& tree_;
  bool cleanup_ = false;
};

void prefetch_body(btCollisionObjectArray& objects, int i) {
  const auto proxy_of = [&](int k) {
    return static_cast<btDbvtProxy*>(objects[k]->getBroadphaseHandle());
  };
  constexpr int kAhead = 4;
  const int count = objects.size();
  if (i + 3 * kAhead < count) {
    prefetch_state(*objects[i + 3 * kAhead]);
    prefetch_island_state(objects[i + 3 * kAhead]);
  }
  if (i + 2 * kAhead < count) prefetch_bytes(proxy_of(i + 2 * kAhead), sizeof(btDbvtProxy));
  if (i + kAhead < count) {
    const btDbvtProxy* proxy = proxy_of(i + kAhead);
    if (proxy != nullptr) prefetch_ends(proxy->leaf, sizeof(btDbvtNode));
  }
}

}  // namespace

bool AabbUpdate::run(btCollisionWorld& world) {
  btBroadphaseInterface& broadphase = *world.getBroadphase();
  if (!is_exactly<btDbvtBroadphase>(broadphase)) return false;
  auto& tree = static_cast<btDbvtBroadphase&>(broadphase);
  btOverlappingPairCache& pair_cache = *tree.m_paircache;
  if (!is_exactly<btHashedOverlappingPairCache>(pair_cache)) return false;
  auto& cache = static_cast<btHashedOverlappingPairCache&>(pair_cache);
  if (tree.m_deferedcollide || cache.getOverlapFilterCallback() != nullptr) return false;
  // Both are called during the update, and may add and remove bodies.
  if (cache.*PairTables::ghosts != nullptr || world.getDebugDrawer() != nullptr) return false;
  const int leaves = tree.m_sets[0].m_leaves + tree.m_sets[1].m_leaves;
  if (!reserve_geometric(static_cast<std::size_t>(leaves))) return false;

  BT_PROFILE("updateAabbs");  // Bullet's own name of the profile zone
  DeferredSearch search(tree);
  btCollisionObjectArray& objects = world.getCollisionObjectArray();
  for (int i = 0; i < objects.size(); ++i) {
    prefetch_body(objects, i);
    btCollisionObject* object = objects[i];
    if (!world.getForceUpdateAllAabbs() && !object->isActive()) continue;
    if (!search.needed_after([&] { world.updateSingleAabb(object); })) continue;
    const auto* proxy = static_cast<const btDbvtProxy*>(object->getBroadphaseHandle());
    pairs_.clear();
    find_overlaps(tree.m_sets[btDbvtBroadphase::FIXED_SET].m_root, proxy->leaf);
    find_overlaps(tree.m_sets[btDbvtBroadphase::DYNAMIC_SET].m_root, proxy->leaf);
    tree.m_newpairs += static_cast<int>(pairs_.size());
    add_pairs(cache);
  }
  return true;
}

/// `leaves` elements suffice: no leaf is found twice, and no node in the stack is an ancestor of
/// another.
bool AabbUpdate::reserve_geometric(std::size_t leaves) noexcept {
  try {
    jfpx::reserve_geometric(&stack_, leaves);
    jfpx::reserve_geometric(&pairs_, leaves);
    return true;
  } catch (const std::bad_alloc&) {
    return false;
  }
}

// btDbvt::collideTTpersistentStack() for a leaf: finds the overlapping leaves in Bullet's order.
// Both children of a node are tested together, so that their cache misses overlap.
void AabbUpdate::find_overlaps(const btDbvtNode* root, const btDbvtNode* leaf) {
  const auto overlaps = [&](const btDbvtNode* node) {
    return node != leaf && Intersect(node->volume, leaf->volume);
  };
  if (root == nullptr || !overlaps(root)) return;
  auto* moved = static_cast<btDbvtProxy*>(leaf->data);
  stack_.assign(1, root);
  while (!stack_.empty()) {
    const btDbvtNode* node = stack_.back();
    stack_.pop_back();
    if (node->isinternal()) {
      const btDbvtNode *first = node->childs[0], *second = node->childs[1];
      prefetch(second);
      if (overlaps(first)) stack_.push_back(first);
      if (overlaps(second)) stack_.push_back(second);
    } else {
      auto* other = static_cast<btDbvtProxy*>(node->data);
      prefetch(&other->m_uniqueId);
      pairs_.push_back({other, moved, false, nullptr, BT_NULL_PAIR});
    }
  }
}

/// Adds the pairs that are not in the cache, in order.
void AabbUpdate::add_pairs(btHashedOverlappingPairCache& cache) {
  btAlignedObjectArray<int>& heads = cache.*PairTables::heads;
  btAlignedObjectArray<int>& next = cache.*PairTables::next;
  btBroadphasePairArray& known = cache.getOverlappingPairArray();
  // The cache uses its capacity, a power of two, as the size of the table.
  const unsigned mask = static_cast<unsigned>(known.capacity()) - 1;
  for (Pair& pair : pairs_) {
    pair.swapped = pair.a->m_uniqueId > pair.b->m_uniqueId;
    if (pair.swapped) std::swap(pair.a, pair.b);
    const unsigned at = hash_of(pair.a->m_uniqueId, pair.b->m_uniqueId) & mask;
    if (at < static_cast<unsigned>(heads.size()))
      prefetch(pair.slot = &heads[static_cast<int>(at)]);
  }
  for (Pair& pair : pairs_) {
    if (pair.slot == nullptr) continue;
    pair.index = *pair.slot;
    if (pair.index == BT_NULL_PAIR) continue;
    prefetch(&known[pair.index]);
    prefetch(&next[pair.index]);
  }
  for (const Pair& pair : pairs_) {
    // Added pairs may move others to a different list; Bullet's own search handles those.
    int index = pair.index;
    while (index != BT_NULL_PAIR &&
           (known[index].m_pProxy0 != pair.a || known[index].m_pProxy1 != pair.b)) {
      index = next[index];
    }
    if (index != BT_NULL_PAIR) continue;
    if (pair.swapped) {
      cache.addOverlappingPair(pair.b, pair.a);
    } else {
      cache.addOverlappingPair(pair.a, pair.b);
    }
  }
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
