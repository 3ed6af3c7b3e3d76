/// Prefetches of Bullet's bodies, algorithms and manifolds, which are scattered in memory.
#pragma once

#include "src/base/prefetch.hpp"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Prefetches `bytes` after an address that may be null or belong to a destroyed object, for which
/// pointer arithmetic is undefined.
inline void prefetch_at(const void* address, std::size_t bytes) {
  // NOLINTNEXTLINE(performance-no-int-to-ptr): nothing is read through the pointer
  prefetch(reinterpret_cast<const void*>(reinterpret_cast<std::uintptr_t>(address) + bytes));
}

inline void prefetch_bytes(const void* address, std::size_t bytes) {
  constexpr std::size_t kCacheLine = 64;
  for (std::size_t i = 0; i < bytes; i += kCacheLine) prefetch_at(address, i);
}

/// For an object no larger than a cache line, which may straddle two lines.
inline void prefetch_ends(const void* address, std::size_t bytes) {
  prefetch(address);
  prefetch_at(address, bytes - 1);
}

/// Pointers to the protected members of a body.
struct BodyFields : btCollisionObject {
  static constexpr auto shape = &BodyFields::m_collisionShape;
  static constexpr auto friction = &BodyFields::m_friction;
  static constexpr auto spinning_friction = &BodyFields::m_spinningFriction;
  static constexpr auto check_collide_with = &BodyFields::m_checkCollideWith;
};

/// Prefetches the position, the fields from the shape to the activation state, and the filter flag.
inline void prefetch_geometry(const btCollisionObject& body) {
  prefetch(&body.getWorldTransform() + 1);  // its end, because the position is last
  prefetch(&(body.*BodyFields::shape));
  prefetch(&(body.*BodyFields::friction));  // directly after the activation state
  prefetch(&(body.*BodyFields::check_collide_with));
}

/// Prefetches the fields of prefetch_geometry() and the vtable pointer.
inline void prefetch_state(const btCollisionObject& body) {
  prefetch(&body);
  prefetch_geometry(body);
}

/// Prefetches all fields that a contact of the body reads.
inline void prefetch_for_contact(const btCollisionObject& body) {
  prefetch_state(body);
  prefetch(&(body.*BodyFields::spinning_friction));
}

/// Prefetches the number of points of a manifold. The member is private; two thresholds separate it
/// from the next public member.
inline void prefetch_count(const btPersistentManifold* manifold) {
  prefetch(reinterpret_cast<const char*>(&manifold->m_companionIdA) - 2 * sizeof(btScalar) -
           sizeof(int));
}

/// Prefetches the bodies, the number of points and the thresholds, which are the last fields.
inline void prefetch_header(const btPersistentManifold* manifold) {
  prefetch_at(manifold, sizeof(btPersistentManifold) - 48);
  prefetch_at(manifold, sizeof(btPersistentManifold) - 1);
}

inline void prefetch_first_point(const btPersistentManifold* manifold) {
  constexpr std::size_t kBytes = sizeof(btTypedObject) + sizeof(btManifoldPoint);
  prefetch_bytes(manifold, kBytes);
  prefetch_at(manifold, kBytes);
}

/// Prefetch distances in elements: manifolds usually miss the caches, bodies rarely do.
inline constexpr int kManifoldsAhead = 16, kObjectsAhead = 8;
/// Minimum number of objects of a world whose loops prefetch: fewer stay in the cache, and the
/// prefetches take longer than the reads.
inline constexpr int kPrefetchedObjects = 8192;

/// Prefetches the flags, island tag, companion id and activation state of an object. The members
/// are private, so the offset is a guess; a wrong guess is harmless.
inline void prefetch_island_state(const btCollisionObject* object) {
  constexpr std::size_t kGuess = sizeof(btScalar) == 4 ? 224 : 400;
  prefetch_at(object, kGuess);
  prefetch_at(object, kGuess + 24);
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
