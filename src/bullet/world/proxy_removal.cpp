/// Follows btCollisionWorld::removeCollisionObject(), btDbvtBroadphase::destroyProxy() and
/// btHashedOverlappingPairCache of Bullet 3.24.
#include "src/bullet/world/proxy_removal.hpp"

#include "src/base/reserve.hpp"
#include "src/bullet/chunks.hpp"
#include "src/bullet/exact_class.hpp"
#include "src/bullet/world/leaf_update.hpp"
#include "src/bullet/world/plain_dispatcher.hpp"
#include "src/bullet/world/plain_ghosts.hpp"

#include <LinearMath/btAlignedAllocator.h>

#include <algorithm>
#include <new>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

constexpr std::size_t kRemovedPairsPerChunk = 8192;
/// Minimum number of pairs for several threads: below, waking threads takes longer.
constexpr std::size_t kSharedRemovedPairs = 65536;

}  // namespace

bool ProxyRemoval::run(btCollisionWorld& world, btCollisionObject& object, ThreadPool& pool) {
  auto* proxy = static_cast<btDbvtProxy*>(object.getBroadphaseHandle());
  btDispatcher* dispatcher = world.getDispatcher();
  btBroadphaseInterface* broadphase = world.getBroadphase();
  if (proxy == nullptr || dispatcher == nullptr || broadphase == nullptr) return false;
  if (!is_exactly<btDbvtBroadphase>(*broadphase)) return false;
  auto& tree = static_cast<btDbvtBroadphase&>(*broadphase);
  if (!is_exactly<btHashedOverlappingPairCache>(*tree.m_paircache)) return false;
  auto& cache = static_cast<btHashedOverlappingPairCache&>(*tree.m_paircache);
  if (!is_plain(*dispatcher) || gContactDestroyedCallback != nullptr ||
      gContactEndedCallback != nullptr || !has_plain_ghosts(world, cache)) {
    return false;
  }
  btBroadphasePairArray& pairs = cache.getOverlappingPairArray();
  if (!find_pairs(pairs, proxy, pool)) return false;

  for (const int i : found_) cache.cleanOverlappingPair(pairs[i], dispatcher);
  remove_leaf(tree, proxy);
  remove_pairs(cache, dispatcher);
  btAlignedFree(proxy);
  tree.m_needcleanup = true;
  object.setBroadphaseHandle(nullptr);
  return true;
}

/// Returns false if there is not enough memory.
bool ProxyRemoval::find_pairs(const btBroadphasePairArray& pairs, const btBroadphaseProxy* proxy,
                              ThreadPool& pool) {
  const auto count = static_cast<std::size_t>(pairs.size());
  const std::size_t size = chunk_size(count, kRemovedPairsPerChunk, kSharedRemovedPairs);
  found_.clear();
  try {
    resize_geometric(&parts_, chunks_of(count, size));
    in_chunks(pool, count, size, [&](std::size_t first, std::size_t last) {
      find_pairs(pairs, static_cast<int>(first), static_cast<int>(last), proxy,
                 &parts_[first / size]);
    });
    for (const std::vector<int>& part : parts_)
      found_.insert(found_.end(), part.begin(), part.end());
  } catch (const std::bad_alloc&) {
    return false;
  }
  return true;
}

void ProxyRemoval::find_pairs(const btBroadphasePairArray& pairs, int first, int last,
                              const btBroadphaseProxy* proxy, std::vector<int>* found) {
  found->clear();
  const auto refers = [&](int i) {
    bool result = pairs[i].m_pProxy0 == proxy;
    result |= pairs[i].m_pProxy1 == proxy;
    return result;
  };
  constexpr int kGroup = 8;  // one branch for several pairs, which rarely refer to the proxy
  for (int i = first; i < last; i += kGroup) {
    const int end = std::min(i + kGroup, last);
    bool any = false;
    for (int k = i; k < end; ++k) any |= refers(k);
    for (int k = i; any && k < end; ++k) {
      if (refers(k)) found->push_back(k);
    }
  }
}

/// Removes the found pairs. In Bullet's order, the last pair replaces a removed pair and is tested
/// next.
void ProxyRemoval::remove_pairs(btHashedOverlappingPairCache& cache, btDispatcher* dispatcher) {
  btBroadphasePairArray& pairs = cache.getOverlappingPairArray();
  std::span<const int> left = found_;
  while (!left.empty()) {
    const int i = left.front(), last = pairs.size() - 1;
    cache.removeOverlappingPair(pairs[i].m_pProxy0, pairs[i].m_pProxy1, dispatcher);
    left = left.back() == last ? left.first(left.size() - 1) : left.subspan(1);
  }
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
