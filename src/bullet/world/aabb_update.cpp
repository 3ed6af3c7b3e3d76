/// Reproduces btDbvtBroadphase and btHashedOverlappingPairCache of Bullet 3.24.
#include "src/bullet/world/aabb_update.hpp"

#include <jfpx/error.hpp>

#include "src/base/backoff.hpp"
#include "src/base/reserve.hpp"
#include "src/bullet/exact_class.hpp"
#include "src/bullet/prefetch.hpp"
#include "src/bullet/world/plain_ghosts.hpp"

#include <LinearMath/btQuickprof.h>

#include <algorithm>
#include <atomic>
#include <new>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

constexpr std::size_t kLeavesPerChunk = 256;

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

/// Time of a search in Bullet's tree, in units of the time to sort a leaf.
constexpr std::size_t kTimeOfSearch = 16;

/// Prefetches the data that apply_update() changes.
void prefetch_leaf(std::span<const LeafUpdate> leaves, std::size_t i) {
  constexpr std::size_t kAhead = 4;
  if (i + 3 * kAhead < leaves.size()) {
    prefetch_bytes(leaves[i + 3 * kAhead].proxy, sizeof(btDbvtProxy));
  }
  if (i + 2 * kAhead < leaves.size() && leaves[i + 2 * kAhead].moves) {
    prefetch_ends(leaves[i + 2 * kAhead].proxy->leaf, sizeof(btDbvtNode));
  }
  if (i + kAhead < leaves.size() && leaves[i + kAhead].moves) {
    const btDbvtNode* parent = leaves[i + kAhead].proxy->leaf->parent;
    if (parent != nullptr) prefetch_ends(parent, sizeof(btDbvtNode));
  }
}

}  // namespace

bool AabbUpdate::run(btCollisionWorld& world, ThreadPool& pool) {
  btBroadphaseInterface& broadphase = *world.getBroadphase();
  if (!is_exactly<btDbvtBroadphase>(broadphase)) return false;
  auto& tree = static_cast<btDbvtBroadphase&>(broadphase);
  btOverlappingPairCache& pair_cache = *tree.m_paircache;
  if (!is_exactly<btHashedOverlappingPairCache>(pair_cache)) return false;
  auto& cache = static_cast<btHashedOverlappingPairCache&>(pair_cache);
  if (tree.m_deferedcollide || cache.getOverlapFilterCallback() != nullptr) return false;
  if (!has_plain_ghosts(world, cache)) return false;
  const int leaves = tree.m_sets[0].m_leaves + tree.m_sets[1].m_leaves;
  if (!reserve_geometric(static_cast<std::size_t>(leaves))) return false;

  // Leaves without an object of the world are not among the updates.
  const bool is_calm = calm_ && pool.threads() == 1 && world.getDebugDrawer() == nullptr;
  if (!is_calm && leaves >= minimum_objects_ && leaves == world.getNumCollisionObjects()) {
    BT_PROFILE("updateAabbs");  // Bullet's name of the profile zone
    if (compute_updates(world, tree, pool)) {
      if (few_leaves_move(pool)) {
        run_in_tree(tree, cache);
        return true;
      }
      if (run_in_parallel(tree, cache, pool)) return true;
    }
  }
  // Called for an AABB that is too large; it may add and remove bodies.
  if (world.getDebugDrawer() != nullptr) return false;
  BT_PROFILE("updateAabbs");
  run_one_by_one(world, tree, cache);
  return true;
}

/// Returns false if Bullet's code must update an object.
bool AabbUpdate::compute_updates(btCollisionWorld& world, btDbvtBroadphase& tree,
                                 ThreadPool& pool) {
  btCollisionObjectArray& objects = world.getCollisionObjectArray();
  const auto count = static_cast<std::size_t>(objects.size());
  leaves_.resize(count);
  std::atomic<bool> possible{true};
  pool.run((count + kLeavesPerChunk - 1) / kLeavesPerChunk, [&](std::size_t chunk) {
    const std::size_t last = std::min(count, (chunk + 1) * kLeavesPerChunk);
    for (std::size_t i = chunk * kLeavesPerChunk; i < last; ++i) {
      prefetch_body(objects, static_cast<int>(i));
      const LeafObstacle obstacle =
          compute_update(world, tree, *objects[static_cast<int>(i)], &leaves_[i]);
      if (obstacle != LeafObstacle::none) possible.store(false, std::memory_order_relaxed);
    }
  });
  return possible;
}

/// Whether searching Bullet's tree for each moving leaf takes less time than a search for all
/// leaves, which sorts them.
bool AabbUpdate::few_leaves_move(const ThreadPool& pool) {
  const auto moving = std::count_if(leaves_.begin(), leaves_.end(),
                                    [](const LeafUpdate& leaf) { return leaf.moves; });
  calm_ = static_cast<std::size_t>(moving) * kTimeOfSearch * pool.threads() < leaves_.size();
  return calm_;
}

/// Moves the leaves, and searches Bullet's tree for the overlaps of each moving leaf.
void AabbUpdate::run_in_tree(btDbvtBroadphase& tree, btHashedOverlappingPairCache& cache) {
  for (std::size_t i = 0; i < leaves_.size(); ++i) {
    prefetch_leaf(leaves_, i);
    if (!leaves_[i].active) continue;
    apply_update(tree, leaves_[i]);
    if (leaves_[i].moves) search_tree(tree, cache, *leaves_[i].proxy);
  }
}

/// Returns false, without a change, if there is not enough memory.
bool AabbUpdate::run_in_parallel(btDbvtBroadphase& tree, btHashedOverlappingPairCache& cache,
                                 ThreadPool& pool) {
  std::size_t overlaps = 0;
  try {
    overlaps = search_.run(pool, leaves_, cache);
    resize_geometric(&new_pairs_, search_.found().size());
  } catch (const OutOfMemory&) {
    return false;
  } catch (const std::bad_alloc&) {
    return false;
  }
  tree.m_newpairs += static_cast<int>(overlaps);
  ordered_ = 0;
  failed_ = false;
  if (adds_without_allocation(cache)) {
    // The pair cache is not read while leaves move, so another thread adds the pairs.
    pool.run(2, [&](std::size_t part) {
      if (part == 1) {
        add_new_pairs(cache);
        return;
      }
      try {
        move_leaves(tree);
      } catch (...) {  // thrown by the user's allocator
        failed_.store(true, std::memory_order_release);
        throw;
      }
    });
  } else {
    move_leaves(tree);
    add_new_pairs(cache);
  }
  return true;
}

/// Whether new pairs exist and can be added on another thread: the user's allocator need not be
/// thread-safe.
bool AabbUpdate::adds_without_allocation(btHashedOverlappingPairCache& cache) const {
  const btBroadphasePairArray& pairs = cache.getOverlappingPairArray();
  const auto room = static_cast<std::size_t>(pairs.capacity() - pairs.size());
  return !new_pairs_.empty() && new_pairs_.size() < room && cache.*PairTables::ghosts == nullptr;
}

/// Moves the leaves one after the other, and sorts the new pairs of each leaf into Bullet's order:
/// fixed objects first, then by position in the tree.
void AabbUpdate::move_leaves(btDbvtBroadphase& tree) {
  const auto is_fixed = [](const NewPair& pair) {
    return pair.other->stage == btDbvtBroadphase::STAGECOUNT;
  };
  const auto is_found_before = [&](const NewPair& a, const NewPair& b) {
    if (is_fixed(a) != is_fixed(b)) return is_fixed(a);
    return is_visited_before(a.other->leaf, b.other->leaf);
  };
  const std::span<const NewOverlap> found = search_.found();
  std::size_t next = 0;
  for (std::size_t i = 0; i < leaves_.size(); ++i) {
    prefetch_leaf(leaves_, i);
    if (!leaves_[i].active) continue;
    apply_update(tree, leaves_[i]);
    const std::size_t first = next;
    for (; next < found.size() && found[next].turn == i; ++next) {
      new_pairs_[next] = {found[next].other, leaves_[i].proxy};
    }
    if (next == first) continue;
    if (next - first > 1) {
      std::sort(new_pairs_.begin() + static_cast<std::ptrdiff_t>(first),
                new_pairs_.begin() + static_cast<std::ptrdiff_t>(next), is_found_before);
    }
    ordered_.store(next, std::memory_order_release);
  }
}

/// Adds the new pairs in the order of move_leaves(), which may run at the same time.
void AabbUpdate::add_new_pairs(btHashedOverlappingPairCache& cache) {
  Backoff backoff(true);
  for (std::size_t next = 0; next < new_pairs_.size();) {
    const std::size_t ordered = ordered_.load(std::memory_order_acquire);
    if (next == ordered) {
      if (failed_.load(std::memory_order_acquire)) return;
      backoff.wait();
      continue;
    }
    backoff.reset();
    for (; next < ordered; ++next) {
      cache.addOverlappingPair(new_pairs_[next].other, new_pairs_[next].moved);
    }
  }
}

/// Moves a leaf, and adds its new pairs, before the update of the next object is computed.
void AabbUpdate::run_one_by_one(btCollisionWorld& world, btDbvtBroadphase& tree,
                                btHashedOverlappingPairCache& cache) {
  DeferredSearch search(tree);
  btCollisionObjectArray& objects = world.getCollisionObjectArray();
  std::size_t moving = 0;
  for (int i = 0; i < objects.size(); ++i) {
    if (objects.size() >= kPrefetchedObjects) prefetch_body(objects, i);
    btCollisionObject* object = objects[i];
    if (!world.getForceUpdateAllAabbs() && !object->isActive()) continue;
    if (!search.needed_after([&] { world.updateSingleAabb(object); })) continue;
    ++moving;
    search_tree(tree, cache, *static_cast<const btDbvtProxy*>(object->getBroadphaseHandle()));
  }
  calm_ = moving * kTimeOfSearch < static_cast<std::size_t>(objects.size());
}

/// Adds the new pairs of a leaf that has moved.
void AabbUpdate::search_tree(btDbvtBroadphase& tree, btHashedOverlappingPairCache& cache,
                             const btDbvtProxy& moved) {
  pairs_.clear();
  find_overlaps(tree.m_sets[btDbvtBroadphase::FIXED_SET].m_root, moved.leaf);
  find_overlaps(tree.m_sets[btDbvtBroadphase::DYNAMIC_SET].m_root, moved.leaf);
  tree.m_newpairs += static_cast<int>(pairs_.size());
  add_pairs(cache);
}

/// `leaves` elements suffice: no leaf is found twice, and no node in the stack is an ancestor of
/// another node.
bool AabbUpdate::reserve_geometric(std::size_t leaves) noexcept {
  try {
    jfpx::reserve_geometric(&stack_, leaves);
    jfpx::reserve_geometric(&pairs_, leaves);
    jfpx::reserve_geometric(&leaves_, leaves);
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
    const unsigned at = pair_hash(pair.a->m_uniqueId, pair.b->m_uniqueId) & mask;
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
    // Added pairs may move other pairs to a different list; Bullet's own search handles those.
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
