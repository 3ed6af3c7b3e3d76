/// Tests whether additions and removals of pairs run user code of the ghost objects of a world.
#pragma once

#include "src/bullet/exact_class.hpp"
#include "src/bullet/world/overlap_search.hpp"

#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>
#include <BulletCollision/CollisionDispatch/btGhostObject.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Ghost objects of a user-defined class, and user-defined callbacks in the pair cache of a ghost,
/// may change the world.
inline bool is_plain_ghost(const btCollisionObject& object) {
  if (is_exactly<btGhostObject>(object)) return true;
  if (!is_exactly<btPairCachingGhostObject>(object)) return false;
  const auto& ghost = static_cast<const btPairCachingGhostObject&>(object);
  // The getter exists only for mutable objects.
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-const-cast)
  auto& cache = *const_cast<btPairCachingGhostObject&>(ghost).getOverlappingPairCache();
  return cache.*PairTables::ghosts == nullptr && cache.getOverlapFilterCallback() == nullptr;
}

/// True if the ghost pair callback, if any, and all ghost objects are classes of Bullet.
inline bool has_plain_ghosts(btCollisionWorld& world, btHashedOverlappingPairCache& cache) {
  const btOverlappingPairCallback* callback = cache.*PairTables::ghosts;
  if (callback == nullptr) return true;
  if (!is_exactly<btGhostPairCallback>(*callback)) return false;
  const btCollisionObjectArray& objects = world.getCollisionObjectArray();
  for (int i = 0; i < objects.size(); ++i) {
    if (objects[i]->getInternalType() == btCollisionObject::CO_GHOST_OBJECT &&
        !is_plain_ghost(*objects[i])) {
      return false;
    }
  }
  return true;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
