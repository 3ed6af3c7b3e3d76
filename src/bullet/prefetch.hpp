/// Asks early for what lies scattered in Bullet's heaps.
#pragma once

#include <jfpx/config.hpp>

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

namespace jfpx::inline JFPX_ABI::bullet {

/// How far ahead of its use: manifolds come from memory, their bodies seldom.
inline constexpr int kManifoldsAhead = 16, kObjectsAhead = 8;

/// The flags, island tag, companion id and activation state of an object. Where they lie is
/// private, so this is a guess, which costs nothing if it is wrong.
inline void prefetch_state(const btCollisionObject* object) {
  constexpr int kGuess = sizeof(btScalar) == 4 ? 224 : 400;
  __builtin_prefetch(reinterpret_cast<const char*>(object) + kGuess);
  __builtin_prefetch(reinterpret_cast<const char*>(object) + kGuess + 24);
}

/// The bodies and the number of points of a manifold, which are its last fields.
inline void prefetch_header(const btPersistentManifold* manifold) {
  const char* end = reinterpret_cast<const char*>(manifold + 1);
  __builtin_prefetch(end - 48);
  __builtin_prefetch(end - 1);
}

}  // namespace jfpx::inline JFPX_ABI::bullet
