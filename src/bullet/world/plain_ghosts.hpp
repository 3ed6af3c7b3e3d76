/// Tests whether the ghost objects of a world run no code of the user when pairs come and go.
#pragma once

#include "src/bullet/exact_class.hpp"
#include "src/bullet/world/overlap_search.hpp"

#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>
#include <BulletCollision/CollisionDispatch/btGhostObject.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Ghost objects of a user's class, and user callbacks in the pair cache of a ghost, may change the
/// world.
inline bool is_plain_ghost(const btCollisionObject& object) {
  if (is_exactly<btGhostObject>(object)) return true;
  if (!is_exactly<btPairCachingGhostObject>(object)) return false;
  const auto& ghost = static_cast<const btPairCachingGhostObject&>(object);
  // Only the getter for mutable objects exists.
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-const-cast)
  auto& cache = *const_cast<btPairCachingGhostObject&>(ghost).getOverlappingPairCache();
  return cache.*PairTables::ghosts == nullptr && cache.getOverlapFilterCallback() == nullptr;
}

/// True if no ghost pair callback is set, or if it is Bullet's and so are all ghost objects.
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
