/// Scans manifolds in chunks; see the header.
#include "src/bullet/solver/contact_scan.hpp"

#include "src/bullet/prefetch.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

constexpr std::size_t kChunk = 256;            ///< manifolds
constexpr std::int32_t kUnlisted = INT32_MIN;  ///< replaces the id of an unlisted body

bool has_infinite_mass(const btRigidBody& body) {
  const btScalar inverse = body.getInvMass();
  return (btVector3(inverse, inverse, inverse) * body.getLinearFactor()).fuzzyZero();
}
/// The BodyFlag bits of the anisotropic friction of a body.
unsigned anisotropy_of(const btCollisionObject& object) {
  unsigned flags = 0;
  if (object.hasAnisotropicFriction(btCollisionObject::CF_ANISOTROPIC_FRICTION)) {
    flags |= kAnisotropic;
  }
  if (object.hasAnisotropicFriction(btCollisionObject::CF_ANISOTROPIC_ROLLING_FRICTION)) {
    flags |= kAnisotropicRolling;
  }
  return flags;
}

struct Side {
  std::int32_t id;
  bool infinite_mass;
  unsigned anisotropy;  ///< BodyFlag bits
};

Side side_of(btCollisionObject* object, std::span<const std::uint8_t> flags) {
  const int companion = object->getCompanionId();
  if (companion >= 0) {
    const std::uint8_t flag = flags[static_cast<std::size_t>(companion) + 1];
    const std::int32_t id = companion + 1;
    return {(flag & kImmovable) != 0 ? ~id : id, (flag & kInfiniteMass) != 0, flag};
  }
  const btRigidBody* body = moving_body(object);
  if (body == nullptr) return {rows::kFixedBody, true, anisotropy_of(*object)};
  return {kUnlisted, has_infinite_mass(*body), anisotropy_of(*object)};
}

btCollisionObject* object_of(const btCollisionObject* object) {
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-const-cast): Bullet's own solver does the same
  return const_cast<btCollisionObject*>(object);
}

}  // namespace

btRigidBody* moving_body(btCollisionObject* object) {
  btRigidBody* body = btRigidBody::upcast(object);
  if (body == nullptr) return nullptr;
  return body->getInvMass() != 0 || body->isKinematicObject() ? body : nullptr;
}

std::uint8_t body_flags(const btRigidBody& body) {
  const btVector3 masses =
      btVector3(body.getInvMass(), body.getInvMass(), body.getInvMass()) * body.getLinearFactor();
  const btMatrix3x3& inertia = body.getInvInertiaTensorWorld();
  unsigned flags = 0;
  if (masses.fuzzyZero()) flags |= kInfiniteMass;
  if (masses.isZero() && inertia[0].isZero() && inertia[1].isZero() && inertia[2].isZero()) {
    flags |= kImmovable;
  }
  return static_cast<std::uint8_t>(flags | anisotropy_of(body));
}

void ContactScan::run(ThreadPool& pool, std::span<btPersistentManifold* const> manifolds,
                      std::span<const std::uint8_t> flags) {
  constexpr std::size_t kMax = MANIFOLD_CACHE_SIZE;
  found_.reserve(kMax * manifolds.size(), "contacts of a solver");
  found_pairs_.reserve(kMax * manifolds.size(), "contacts of a solver");
  unlisted_.clear();
  const std::size_t chunks = (manifolds.size() + kChunk - 1) / kChunk;
  chunks_.reserve(chunks, "contacts of a solver");
  pool.run(chunks, [&](std::size_t chunk) { scan(manifolds, chunk, flags); });
  count_ = 0;
  any_unlisted_ = any_rolling_ = any_anisotropic_ = false;
  for (std::size_t i = 0; i < chunks; ++i) {
    any_rolling_ |= chunks_[i].rolling;
    any_unlisted_ |= chunks_[i].unlisted;
    any_anisotropic_ |= chunks_[i].anisotropic;
    count_ += chunks_[i].count;
  }
  refs_.reserve(count_, "contacts of a solver");
  pairs_.reserve(count_, "contacts of a solver");
  std::size_t next = 0;
  for (std::size_t i = 0; i < chunks; ++i) {
    std::copy_n(found_.data() + kMax * kChunk * i, chunks_[i].count, refs_.data() + next);
    std::copy_n(found_pairs_.data() + kMax * kChunk * i, chunks_[i].count, pairs_.data() + next);
    next += chunks_[i].count;
  }
}

void ContactScan::scan(std::span<btPersistentManifold* const> manifolds, std::size_t chunk,
                       std::span<const std::uint8_t> flags) {
  const std::size_t first = chunk * kChunk, last = std::min(first + kChunk, manifolds.size());
  ContactRef* const refs = found_.data() + MANIFOLD_CACHE_SIZE * first;
  cpu::RowPair* const pairs = found_pairs_.data() + MANIFOLD_CACHE_SIZE * first;
  std::uint32_t count = 0;
  bool rolling = false, unlisted = false, anisotropic = false;
  for (std::size_t i = first; i < last; ++i) {
    if (i + kManifoldsAhead < last) prefetch_header(manifolds[i + kManifoldsAhead]);
    if (i + kObjectsAhead < last) {
      const btPersistentManifold& later = *manifolds[i + kObjectsAhead];
      prefetch_island_state(later.getBody0());
      prefetch_island_state(later.getBody1());
      if (later.getNumContacts() > 0) prefetch(&later.getContactPoint(0).m_distance1);
    }
    btPersistentManifold* manifold = manifolds[i];
    const int points = manifold->getNumContacts();
    const Side a = side_of(object_of(manifold->getBody0()), flags);
    const Side b = side_of(object_of(manifold->getBody1()), flags);
    unlisted |= a.id == kUnlisted || b.id == kUnlisted;
    if (a.infinite_mass && b.infinite_mass) continue;
    const unsigned anisotropy = a.anisotropy | b.anisotropy;
    const bool is_anisotropic = (anisotropy & kAnisotropic) != 0;
    for (int k = 0; k < points; ++k) {
      const btManifoldPoint& point = manifold->getContactPoint(k);
      if (!(point.getDistance() <= manifold->getContactProcessingThreshold())) continue;
      const bool rolls = point.m_combinedRollingFriction > 0;
      rolling |= rolls;
      anisotropic |= is_anisotropic;
      refs[count] = {manifold, k, is_anisotropic, rolls,
                     rolls && (anisotropy & kAnisotropicRolling) != 0};
      pairs[count++] = {a.id, b.id};
    }
  }
  chunks_[chunk] = {count, rolling, unlisted, anisotropic};
}

void ContactScan::register_unlisted(std::span<btPersistentManifold* const> manifolds,
                                    std::size_t first_id) {
  if (!any_unlisted_) return;
  // Includes manifolds without contacts, because Bullet also writes their bodies back.
  for (btPersistentManifold* manifold : manifolds) {
    for (const btCollisionObject* object : {manifold->getBody0(), manifold->getBody1()}) {
      btCollisionObject* unlisted = object_of(object);
      if (unlisted->getCompanionId() >= 0 || moving_body(unlisted) == nullptr) continue;
      unlisted_.push_back({unlisted, unlisted->getCompanionId()});
      unlisted->setCompanionId(static_cast<int>(first_id + unlisted_.size()) - 2);
    }
  }
  const auto resolve = [&](const btCollisionObject* object, std::int32_t* id) {
    if (*id != kUnlisted) return;
    *id = object->getCompanionId() + 1;
    if ((body_flags(*btRigidBody::upcast(object)) & kImmovable) != 0) *id = ~*id;
  };
  for (std::size_t i = 0; i < count_; ++i) {
    resolve(refs_[i].manifold->getBody0(), &pairs_[i].a);
    resolve(refs_[i].manifold->getBody1(), &pairs_[i].b);
  }
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
