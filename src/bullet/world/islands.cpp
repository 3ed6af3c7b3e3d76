/// Reproduces btSimulationIslandManager.cpp and the island callback of btDiscreteDynamicsWorld.cpp
/// of Bullet 3.24, step by step.
#include "src/bullet/world/islands.hpp"

#include <jfpx/error.hpp>

#include "src/base/reserve.hpp"
#include "src/bullet/chunks.hpp"
#include "src/bullet/prefetch.hpp"
#include "src/bullet/solver/joint_rows.hpp"
#include "src/bullet/world/parallel_quick_sort.hpp"
#include "src/bullet/world/plain_dispatcher.hpp"

#include <BulletDynamics/ConstraintSolver/btContactSolverInfo.h>
#include <BulletDynamics/ConstraintSolver/btTypedConstraint.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <LinearMath/btQuickprof.h>

#include <algorithm>
#include <atomic>
#include <new>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

constexpr std::size_t kIslandManifoldsPerChunk = 512, kIslandPairsPerChunk = 512;
constexpr std::size_t kObjectsPerChunk = 1024;
/// Minimum numbers for several threads: below, waking threads takes longer.
constexpr std::size_t kSharedIslandManifolds = 4096, kSharedIslandPairs = 4096;

/// btUnionFind::find() without path compression, so that threads may search concurrently.
int root_of(const btUnionFind& unions, int x) {
  while (x != unions.getElement(x).m_id) x = unions.getElement(x).m_id;
  return x;
}

/// Compresses the paths of later searches to one step.
void point_to_roots(btUnionFind* unions) {
  for (int i = 0; i < unions->getNumElements(); ++i) unions->getElement(i).m_id = unions->find(i);
}

void prefetch_island_state_of(const btCollisionObjectArray& objects, int i) {
  const int count = objects.size();
  if (count >= kPrefetchedObjects && i < count) prefetch_island_state(objects[i]);
}
/// @param number of the next movable object
void number_object(btCollisionObjectArray& objects, int i, int* number) {
  prefetch_island_state_of(objects, i + kObjectsAhead);
  btCollisionObject& object = *objects[i];
  if (!object.isStaticOrKinematicObject()) object.setIslandTag((*number)++);
  object.setCompanionId(-1);
  object.setHitFraction(1);
}
const btCollisionObject* object_of(const btBroadphaseProxy* proxy) {
  return static_cast<const btCollisionObject*>(proxy->m_clientObject);
}
bool merges(const btCollisionObject* object) {
  return object != nullptr && object->mergesSimulationIslands();
}
int island_of(const btCollisionObject& a, const btCollisionObject& b) {
  return a.getIslandTag() >= 0 ? a.getIslandTag() : b.getIslandTag();
}
int island_of(const btTypedConstraint& constraint) {
  return island_of(constraint.getRigidBodyA(), constraint.getRigidBodyB());
}

/// Wakes the objects that a moving kinematic object overlaps.
void wake(const btCollisionObject& kinematic, const btCollisionObject& other) {
  if (kinematic.isKinematicObject() && kinematic.getActivationState() != ISLAND_SLEEPING &&
      kinematic.hasContactResponse()) {
    other.activate();
  }
}

/// Whether the manifold belongs to the islands to solve. Sets `kinematic` if the result may depend
/// on objects woken by kinematic objects.
bool needs_solving(btDispatcher& dispatcher, const btPersistentManifold& manifold,
                   bool only_touching, bool* kinematic) {
  if (only_touching && manifold.getNumContacts() == 0) return false;
  const btCollisionObject &a = *manifold.getBody0(), &b = *manifold.getBody1();
  if (a.getActivationState() == ISLAND_SLEEPING && b.getActivationState() == ISLAND_SLEEPING) {
    return false;
  }
  if (a.isKinematicObject() || b.isKinematicObject()) *kinematic = true;
  return dispatcher.needsResponse(&a, &b);
}

/// Calls unite(a, b) with the numbers of the objects of each pair that belongs to one island.
template <class Unite>
void for_each_union(std::span<const btBroadphasePair> pairs, const Unite& unite) {
  const std::size_t count = pairs.size();
  const bool prefetches = count >= kPrefetchedObjects;
  for (std::size_t i = 0; i < count; ++i) {
    if (prefetches && i + 2 * kObjectsAhead < count) {
      prefetch(pairs[i + 2 * kObjectsAhead].m_pProxy0);
      prefetch(pairs[i + 2 * kObjectsAhead].m_pProxy1);
    }
    if (prefetches && i + kObjectsAhead < count) {
      prefetch_island_state(object_of(pairs[i + kObjectsAhead].m_pProxy0));
      prefetch_island_state(object_of(pairs[i + kObjectsAhead].m_pProxy1));
    }
    const btCollisionObject *a = object_of(pairs[i].m_pProxy0), *b = object_of(pairs[i].m_pProxy1);
    if (merges(a) && merges(b)) unite(a->getIslandTag(), b->getIslandTag());
  }
}

/// Whether a kinematic object, or a user-defined dispatcher, may wake objects of sleeping islands.
bool may_be_woken(btCollisionWorld& world) {
  if (!is_plain(*world.getDispatcher())) return true;
  const btCollisionObjectArray& objects = world.getCollisionObjectArray();
  for (int i = 0; i < objects.size(); ++i) {
    prefetch_island_state_of(objects, i + kObjectsAhead);
    if (objects[i]->isKinematicObject()) return true;
  }
  return false;
}

void prefetch_manifold(btPersistentManifold* const* manifolds, std::size_t i, std::size_t count) {
  if (i + 2 * kManifoldsAhead < count) prefetch_header(manifolds[i + 2 * kManifoldsAhead]);
  if (i + kManifoldsAhead < count) {
    prefetch_island_state(manifolds[i + kManifoldsAhead]->getBody0());
    prefetch_island_state(manifolds[i + kManifoldsAhead]->getBody1());
  }
}

}  // namespace

bool IslandSolver::reserve_for_unions(btCollisionWorld& world) noexcept {
  const auto objects = static_cast<std::size_t>(world.getNumCollisionObjects());
  const auto pairs = static_cast<std::size_t>(world.getPairCache()->getNumOverlappingPairs());
  try {
    resize_geometric(&numbers_, chunks_of(objects, kObjectsPerChunk) + 1);
    resize_geometric(&chunk_counts_, std::min(pairs, pairs_per_round_) / kIslandPairsPerChunk + 1);
    edges_.reserve(std::min(pairs, pairs_per_round_), "pairs of islands");
  } catch (const OutOfMemory&) {
    return false;
  } catch (const std::bad_alloc&) {
    return false;
  }
  return true;
}

void IslandSolver::number_and_unite(btCollisionWorld& world, btUnionFind* unions) {
  number_objects(world.getCollisionObjectArray());
  unions->reset(numbers_.back());
  btOverlappingPairCache* cache = world.getPairCache();
  const auto count = static_cast<std::size_t>(cache->getNumOverlappingPairs());
  if (count == 0) return;
  const std::span pairs(cache->getOverlappingPairArrayPtr(), count);
  // The first pairs unite most objects, so most of the remaining pairs connect objects of one set.
  // Threads discard these pairs.
  const auto objects = static_cast<std::size_t>(numbers_.back());
  std::size_t first = std::min(count, 2 * objects);
  if (pool_.threads() == 1 || count - first < kSharedIslandPairs) first = count;
  for_each_union(pairs.first(first), [&](int a, int b) { unions->unite(a, b); });
  for (; first < count; first += pairs_per_round_) {
    point_to_roots(unions);
    const int edges =
        find_edges(pairs.subspan(first, std::min(pairs_per_round_, count - first)), *unions);
    for (int i = 0; i < edges; ++i) {
      const Edge& edge = edges_[static_cast<std::size_t>(i)];
      unions->unite(edge.a, edge.b);
    }
  }
}

/// Calls run(chunk, first, last) for all chunks of objects in parallel.
template <class Run>
void IslandSolver::in_object_chunks(const btCollisionObjectArray& objects, const Run& run) {
  in_chunks(pool_, static_cast<std::size_t>(objects.size()), kObjectsPerChunk,
            [&](std::size_t first, std::size_t last) {
              run(first / kObjectsPerChunk, static_cast<int>(first), static_cast<int>(last));
            });
}

/// Numbers the movable objects; numbers_ receives the first number of each chunk, and the total.
void IslandSolver::number_objects(btCollisionObjectArray& objects) {
  if (pool_.threads() == 1) {
    int number = 0;
    for (int i = 0; i < objects.size(); ++i) {
      if (static_cast<std::size_t>(i) % kObjectsPerChunk == 0) {
        numbers_[static_cast<std::size_t>(i) / kObjectsPerChunk] = number;
      }
      number_object(objects, i, &number);
    }
    numbers_.back() = number;
    return;
  }
  in_object_chunks(objects, [&](std::size_t chunk, int first, int last) {
    int movable = 0;
    for (int i = first; i < last; ++i) {
      prefetch_island_state_of(objects, i + kObjectsAhead);
      movable += objects[i]->isStaticOrKinematicObject() ? 0 : 1;
    }
    numbers_[chunk] = movable;
  });
  numbers_.back() = 0;
  int next = 0;
  for (int& number : numbers_) next += std::exchange(number, next);
  in_object_chunks(objects, [&](std::size_t chunk, int first, int last) {
    int number = numbers_[chunk];
    for (int i = first; i < last; ++i) number_object(objects, i, &number);
  });
}

/// Lists the pairs of objects in different sets, in order. Reads the sets without changing the
/// results of find(). @return the number of pairs
int IslandSolver::find_edges(std::span<const btBroadphasePair> pairs, const btUnionFind& unions) {
  const std::size_t count = pairs.size(), chunks = chunks_of(count, kIslandPairsPerChunk);
  in_chunks(pool_, count, kIslandPairsPerChunk, [&](std::size_t first, std::size_t last) {
    std::size_t next = first;
    for_each_union(pairs.subspan(first, last - first), [&](int a, int b) {
      if (root_of(unions, a) != root_of(unions, b)) edges_[next++] = {a, b};
    });
    chunk_counts_[first / kIslandPairsPerChunk] = static_cast<int>(next - first);
  });
  int total = 0;
  for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
    const auto found = static_cast<std::size_t>(chunk_counts_[chunk]);
    std::copy_n(edges_.data() + chunk * kIslandPairsPerChunk, found, edges_.data() + total);
    total += static_cast<int>(found);
  }
  return total;
}

void IslandSolver::store_islands(btCollisionWorld& world, btUnionFind* unions) {
  btCollisionObjectArray& objects = world.getCollisionObjectArray();
  in_object_chunks(objects, [&](std::size_t chunk, int first, int last) {
    int number = numbers_[chunk];
    for (int i = first; i < last; ++i) {
      prefetch_island_state_of(objects, i + kObjectsAhead);
      btCollisionObject* object = objects[i];
      if (object->isStaticOrKinematicObject()) {
        object->setIslandTag(-1);
        object->setCompanionId(-2);
      } else {
        object->setIslandTag(root_of(*unions, number));
        unions->getElement(number).m_sz = i;
        object->setCompanionId(-1);
        ++number;
      }
    }
  });
}

bool IslandSolver::reserve_geometric(btCollisionWorld& world, int constraint_count) noexcept {
  const auto manifolds = static_cast<std::size_t>(world.getDispatcher()->getNumManifolds());
  try {
    found_.reserve(manifolds, "manifolds of islands");
    found_island_.reserve(manifolds, "manifolds of islands");
    jfpx::reserve_geometric(&chunk_counts_, manifolds / kIslandManifoldsPerChunk + 1);
    jfpx::reserve_geometric(&manifolds_, manifolds);
    jfpx::reserve_geometric(&bodies_, static_cast<std::size_t>(world.getNumCollisionObjects()));
    jfpx::reserve_geometric(&constraints_, static_cast<std::size_t>(constraint_count));
    // Each group has an island, and the last one may be empty.
    jfpx::reserve_geometric(&groups_, static_cast<std::size_t>(world.getNumCollisionObjects()) + 1);
  } catch (const OutOfMemory&) {
    return false;
  } catch (const std::bad_alloc&) {
    return false;
  }
  return true;
}

void IslandSolver::solve(btCollisionWorld& world, btUnionFind& unions, btConstraintSolver& solver,
                         const btContactSolverInfo& info, btTypedConstraint** constraints,
                         int constraint_count) {
  {
    BT_PROFILE("islandUnionFindAndQuickSort");
    sort_islands(unions);
    const bool awake = update_sleep(world.getCollisionObjectArray(), unions);
    count_ = 0;
    if (awake || may_be_woken(world)) collect_manifolds(world);
  }
  BT_PROFILE("processIslands");
  solve_awake(world, unions, solver, info, constraints, constraint_count);
}

/// btUnionFind::sortIslands()
void IslandSolver::sort_islands(btUnionFind& unions) {
  const int count = unions.getNumElements();
  if (count == 0) return;
  point_to_roots(&unions);
  const std::span elements(&unions.getElement(0), static_cast<std::size_t>(count));
  parallel_quick_sort(pool_, elements,
                      [](const btElement& l, const btElement& r) { return l.m_id < r.m_id; });
}

/// An island sleeps if none of its objects is awake; otherwise all of its objects are woken.
/// @return whether any island is awake
bool IslandSolver::update_sleep(btCollisionObjectArray& objects, btUnionFind& unions) {
  const int count = unions.getNumElements();
  bool any_awake = false;
  const auto object = [&](int k) { return objects[unions.getElement(k).m_sz]; };
  for (int first = 0, last = 0; first < count; first = last) {
    const int island = unions.getElement(first).m_id;
    bool asleep = true;
    for (last = first; last < count && unions.getElement(last).m_id == island; ++last) {
      if (count >= kPrefetchedObjects && last + kObjectsAhead < count) {
        prefetch_island_state(object(last + kObjectsAhead));
      }
      const btCollisionObject& o = *object(last);
      const int state = o.getActivationState();
      if (o.getIslandTag() == island && (state == ACTIVE_TAG || state == DISABLE_DEACTIVATION)) {
        asleep = false;
      }
    }
    any_awake |= !asleep;
    for (int k = first; k < last; ++k) {
      btCollisionObject& o = *object(k);
      if (o.getIslandTag() != island) continue;
      if (asleep) {
        o.setActivationState(ISLAND_SLEEPING);
      } else if (o.getActivationState() == ISLAND_SLEEPING) {
        o.setActivationState(WANTS_DEACTIVATION);
        o.setDeactivationTime(0);
      }
    }
  }
  return any_awake;
}

/// Lists the manifolds of the islands to solve, and their islands.
void IslandSolver::collect_manifolds(btCollisionWorld& world) {
  btDispatcher& dispatcher = *world.getDispatcher();
  const bool only_touching = world.getDispatchInfo().m_deterministicOverlappingPairs;
  const int count = dispatcher.getNumManifolds();
  const bool plain = is_plain(dispatcher);
  if (plain && collect_in_parallel(dispatcher, only_touching)) return;
  btPersistentManifold** manifolds = plain ? dispatcher.getInternalManifoldPointer() : nullptr;
  count_ = 0;
  for (int i = 0; i < count; ++i) {
    if (plain) {
      prefetch_manifold(manifolds, static_cast<std::size_t>(i), static_cast<std::size_t>(count));
    }
    btPersistentManifold* manifold =
        plain ? manifolds[i] : dispatcher.getManifoldByIndexInternal(i);
    if (only_touching && manifold->getNumContacts() == 0) continue;
    const btCollisionObject &a = *manifold->getBody0(), &b = *manifold->getBody1();
    if (a.getActivationState() == ISLAND_SLEEPING && b.getActivationState() == ISLAND_SLEEPING) {
      continue;
    }
    wake(a, b);
    wake(b, a);
    if (!dispatcher.needsResponse(&a, &b)) continue;
    const auto at = static_cast<std::size_t>(count_++);
    found_[at] = manifold;
    found_island_[at] = island_of(a, b);
  }
}

/// Parallel version for a plain dispatcher. Returns false if kinematic objects may wake others.
bool IslandSolver::collect_in_parallel(btDispatcher& dispatcher, bool only_touching) {
  const auto count = static_cast<std::size_t>(dispatcher.getNumManifolds());
  const std::size_t size = chunk_size(count, kIslandManifoldsPerChunk, kSharedIslandManifolds);
  const std::size_t chunks = chunks_of(count, size);
  btPersistentManifold** manifolds = dispatcher.getInternalManifoldPointer();
  chunk_counts_.assign(chunks, 0);
  std::atomic<bool> kinematic{false};
  in_chunks(pool_, count, size, [&](std::size_t first, std::size_t last) {
    bool seen = false;
    std::size_t next = first;
    for (std::size_t i = first; i < last; ++i) {
      if (chunks > 1) prefetch_manifold(manifolds, i, last);  // fewer fit into the cache
      if (!needs_solving(dispatcher, *manifolds[i], only_touching, &seen)) continue;
      found_[next] = manifolds[i];
      found_island_[next++] = island_of(*manifolds[i]->getBody0(), *manifolds[i]->getBody1());
    }
    chunk_counts_[first / size] = static_cast<int>(next - first);
    if (seen) kinematic.store(true, std::memory_order_relaxed);
  });
  if (kinematic) return false;
  count_ = 0;
  for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
    const int found = chunk_counts_[chunk];
    std::copy_n(found_.data() + chunk * size, found, found_.data() + count_);
    std::copy_n(found_island_.data() + chunk * size, found, found_island_.data() + count_);
    count_ += found;
  }
  return true;
}

/// Bullet's sort is not stable. Sorting keys that compare identically with the same algorithm
/// reproduces the order.
void IslandSolver::sort_manifolds(bool by_pair) {
  keys_.resizeNoInitialize(count_);
  if (!by_pair) {
    for (int i = 0; i < count_; ++i) {
      keys_[i] = {found_island_[static_cast<std::size_t>(i)], i};
    }
    if (count_ == 0) return;
    const std::span keys(&keys_[0], static_cast<std::size_t>(count_));
    parallel_quick_sort(pool_, keys,
                        [](const IslandKey& l, const IslandKey& r) { return l.island < r.island; });
    return;
  }
  pair_keys_.resizeNoInitialize(count_);
  for (int i = 0; i < count_; ++i) {
    const auto at = static_cast<std::size_t>(i);
    pair_keys_[i] = {found_island_[at], found_[at]->getBody0()->getBroadphaseHandle()->m_uniqueId,
                     found_[at]->getBody1()->getBroadphaseHandle()->m_uniqueId, i};
  }
  pair_keys_.quickSort([](const PairKey& l, const PairKey& r) {
    if (l.island != r.island) return l.island < r.island;
    return l.uid0 != r.uid0 ? l.uid0 < r.uid0 : l.uid1 < r.uid1;
  });
  for (int i = 0; i < count_; ++i) keys_[i] = {pair_keys_[i].island, pair_keys_[i].index};
}

/// Adds the manifolds of the keys [first, last) to the group.
void IslandSolver::add_manifolds(int first, int last) {
  const std::size_t before = manifolds_.size();
  const auto count = static_cast<std::size_t>(last - first);
  manifolds_.resize(before + count);
  const std::size_t size = chunk_size(count, kIslandManifoldsPerChunk, kSharedIslandManifolds);
  in_chunks(pool_, count, size, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const int key = keys_[first + static_cast<int>(k)].index;
      manifolds_[before + k] = found_[static_cast<std::size_t>(key)];
    }
  });
}

void IslandSolver::solve_awake(btCollisionWorld& world, btUnionFind& unions,
                               btConstraintSolver& solver, const btContactSolverInfo& info,
                               btTypedConstraint** constraints, int constraint_count) {
  sort_manifolds(world.getDispatchInfo().m_deterministicOverlappingPairs);
  const btCollisionObjectArray& objects = world.getCollisionObjectArray();
  // A constraint of another class may change any body, while Bullet reads the next island.
  GroupBatch* const batch =
      are_known_joints({constraints, static_cast<std::size_t>(constraint_count)})
          ? GroupBatch::of(solver)
          : nullptr;
  GroupSizes begin{};  // of the group, in the lists
  const auto start = [&] {
    bodies_.clear();
    manifolds_.clear();
    constraints_.clear();
    groups_.clear();
  };
  const auto end_group = [&] {
    groups_.push_back({std::span(bodies_).subspan(begin.bodies),
                       std::span(manifolds_).subspan(begin.manifolds),
                       std::span(constraints_).subspan(begin.constraints)});
    if (batch != nullptr) {  // all groups together, because they change no state that is read here
      begin = {bodies_.size(), manifolds_.size(), constraints_.size()};
      return;
    }
    solve_group(solver, groups_.back(), info, world.getDebugDrawer(), world.getDispatcher());
    start();
  };
  start();  // discards dangling pointers after an exception of a solver
  int key = 0, joint = 0;
  for (int first = 0, last = 0; first < unions.getNumElements(); first = last) {
    const int island = unions.getElement(first).m_id;
    const std::size_t bodies_before = bodies_.size();
    bool awake = false;
    for (last = first; last < unions.getNumElements() && unions.getElement(last).m_id == island;
         ++last) {
      bodies_.push_back(objects[unions.getElement(last).m_sz]);
      awake |= bodies_.back()->isActive();
    }
    const int first_key = key;
    while (key < keys_.size() && keys_[key].island == island) ++key;
    if (!awake) {
      bodies_.resize(bodies_before);
      continue;
    }
    add_manifolds(first_key, key);
    while (joint < constraint_count && island_of(*constraints[joint]) < island) ++joint;
    for (; joint < constraint_count && island_of(*constraints[joint]) == island; ++joint) {
      constraints_.push_back(constraints[joint]);
    }
    // Small islands are collected into one group.
    const int size = static_cast<int>(constraints_.size() - begin.constraints + manifolds_.size() -
                                      begin.manifolds);
    if (info.m_minimumSolverBatchSize <= 1 || size > info.m_minimumSolverBatchSize) end_group();
  }
  end_group();  // as in Bullet, even if the group is empty
  if (batch == nullptr) return;
  batch->solve(static_cast<ConstraintSolver&>(solver), groups_, info, world.getDebugDrawer(),
               world.getDispatcher());
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
