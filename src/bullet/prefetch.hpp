/// What to ask for in time: bodies, algorithms and manifolds lie anywhere.
#pragma once

#include "src/base/prefetch.hpp"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Some bytes behind an address that may be null or of something that has gone: there, arithmetic
/// with pointers is undefined.
inline void prefetch_at(const void* address, std::size_t bytes) {
  // NOLINTNEXTLINE(performance-no-int-to-ptr): nothing is read through it
  prefetch(reinterpret_cast<const void*>(reinterpret_cast<std::uintptr_t>(address) + bytes));
}

inline void prefetch_bytes(const void* address, std::size_t bytes) {
  constexpr std::size_t kCacheLine = 64;
  for (std::size_t i = 0; i < bytes; i += kCacheLine) prefetch_at(address, i);
}

/// For an object no larger than a cache line, which may lie across two.
inline void prefetch_ends(const void* address, std::size_t bytes) {
  prefetch(address);
  prefetch_at(address, bytes - 1);
}

/// Where the protected fields of a body lie.
struct BodyFields : btCollisionObject {
  static constexpr auto shape = &BodyFields::m_collisionShape;
  static constexpr auto friction = &BodyFields::m_friction;
  static constexpr auto spinning_friction = &BodyFields::m_spinningFriction;
  static constexpr auto check_collide_with = &BodyFields::m_checkCollideWith;
};

/// Position, the fields from the shape to the activation, and whether there is a filter.
inline void prefetch_place(const btCollisionObject& body) {
  prefetch(&body.getWorldTransform() + 1);  // its end: the position is last
  prefetch(&(body.*BodyFields::shape));
  prefetch(&(body.*BodyFields::friction));  // right behind the activation
  prefetch(&(body.*BodyFields::check_collide_with));
}

/// The same, and its class.
inline void prefetch_state(const btCollisionObject& body) {
  prefetch(&body);
  prefetch_place(body);
}

/// All that a contact of the body needs.
inline void prefetch_for_contact(const btCollisionObject& body) {
  prefetch_state(body);
  prefetch(&(body.*BodyFields::spinning_friction));
}

/// The number of points of a manifold. It is private: two thresholds lie between it and the first
/// public member behind.
inline void prefetch_count(const btPersistentManifold* manifold) {
  prefetch(reinterpret_cast<const char*>(&manifold->m_companionIdA) - 2 * sizeof(btScalar) -
           sizeof(int));
}

/// The bodies, the number of points and the thresholds of a manifold, which are its last fields.
inline void prefetch_header(const btPersistentManifold* manifold) {
  prefetch_at(manifold, sizeof(btPersistentManifold) - 48);
  prefetch_at(manifold, sizeof(btPersistentManifold) - 1);
}

inline void prefetch_first_point(const btPersistentManifold* manifold) {
  constexpr std::size_t kBytes = sizeof(btTypedObject) + sizeof(btManifoldPoint);
  prefetch_bytes(manifold, kBytes);
  prefetch_at(manifold, kBytes);
}

/// How far ahead of its use: manifolds come from memory, their bodies seldom.
inline constexpr int kManifoldsAhead = 16, kObjectsAhead = 8;

/// The flags, island tag, companion id and activation state of an object. Where they lie is
/// private, so this is a guess, which costs nothing if it is wrong.
inline void prefetch_island_state(const btCollisionObject* object) {
  constexpr std::size_t kGuess = sizeof(btScalar) == 4 ? 224 : 400;
  prefetch_at(object, kGuess);
  prefetch_at(object, kGuess + 24);
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
