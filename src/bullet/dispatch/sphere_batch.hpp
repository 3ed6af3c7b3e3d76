/// The read-only first pass of a dispatch, which gathers the bodies and pairs of one pair cache.
#pragma once

#include <jfpx/sphere_collider.hpp>

#include "src/bullet/dispatch/packed_body.hpp"
#include "src/bullet/dispatch/pair_table.hpp"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>

#include <algorithm>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Properties of a body, besides its sphere, that affect the dispatch.
enum BodyTrait : std::uint8_t {
  kSphere = 1,
  kActive = 2,
  /// Its class may override btCollisionObject::checkCollideWithOverride, which must be called.
  kOverridesFilter = 4,
  kBox = 8,              ///< exactly a btBoxShape
  kPlane = 16,           ///< exactly a btStaticPlaneShape
  kHasIgnoreList = 32,   ///< has an ignore list or a filter, which must be evaluated
  kCustomMaterial = 64,  ///< write_contact() is insufficient for its contacts
  /// Exactly one of Bullet's boxes, capsules, cylinders, cones or multi-spheres, or a convex hull
  /// without polyhedral features.
  kConvex = 128,
};

/// The traits of a body with this shape that follow from the shape.
unsigned traits_of(const btCollisionShape& shape);

/// The first contact of pair `pair` or of a later pair.
inline const PairContact* first_contact(std::span<const PairContact> touching, std::size_t pair) {
  return std::lower_bound(
      touching.data(), touching.data() + touching.size(), pair,
      [](const PairContact& contact, std::size_t i) { return contact.pair < i; });
}

/// Bodies and pairs of one dispatch, in the form for the collider and the commit.
class SphereBatch {
 public:
  /// Sets the expected number of contacts. If it exceeds the number of bodies, gather() copies the
  /// body fields that contacts need; otherwise they are read on demand.
  void expect_contacts(std::size_t contacts) { expected_contacts_ = contacts; }
  /// Reads the bodies of `pairs`, and returns the number of spheres among them.
  std::size_t gather(std::span<const btBroadphasePair> pairs, const PairOwner& owner,
                     ThreadPool& pool);
  void note_release(const btPersistentManifold* manifold) noexcept {
    table_.note_release(manifold);
  }
  /// Discards all cached data. Required after gather() has thrown.
  void invalidate() noexcept { table_.invalidate(); }

  /// One entry per body. A body that is not a sphere has a radius of NaN. The collider therefore
  /// reports each of its pairs as touching, and the commit rejects them, which costs less than
  /// testing every pair.
  std::span<const SphereInstance> spheres() const { return spheres_; }
  std::span<const SpherePair> pairs() const { return table_.pairs(); }

  /// Whether the pair was pair i when its bodies were read.
  bool is_entry_of(const btBroadphasePair& pair, std::size_t i) const {
    return table_.is_entry_of(pair, i);
  }
  bool is_entry_of_proxies(const btBroadphasePair& pair, std::size_t i) const {
    return table_.is_entry_of_proxies(pair, i);
  }
  /// Whether those bodies of pair i that were spheres still are the same spheres. The bodies must
  /// exist.
  bool has_current_spheres(std::size_t i) const {
    return is_current(pairs()[i].a) && is_current(pairs()[i].b);
  }

  PairKind kind(std::size_t i) const { return table_.kind(i); }
  /// The manifold of pair i; null if the kind is PairKind::other.
  btPersistentManifold* manifold(std::size_t i) const { return table_.manifold(i); }
  const btCollisionObject* body_a(std::size_t i) const { return bodies_[pairs()[i].a]; }
  const btCollisionObject* body_b(std::size_t i) const { return bodies_[pairs()[i].b]; }
  PackedBody state_a(std::size_t i) const { return state(pairs()[i].a); }
  PackedBody state_b(std::size_t i) const { return state(pairs()[i].b); }
  /// Prefetches the body fields that the contact of pair i reads.
  void prefetch_states(std::size_t i) const;
  Real radius_b(std::size_t i) const { return spheres_[pairs()[i].b].radius; }
  bool both_are_spheres(std::size_t i) const { return (trait_a(i) & trait_b(i) & kSphere) != 0; }
  std::uint8_t trait_a(std::size_t i) const { return traits_[pairs()[i].a]; }
  std::uint8_t trait_b(std::size_t i) const { return traits_[pairs()[i].b]; }
  /// Union of the traits of both bodies of pair i.
  unsigned either_trait(std::size_t i) const {
    return static_cast<unsigned>(trait_a(i) | trait_b(i));
  }
  /// The number of bodies that are compounds whose first child is a sphere.
  std::size_t wrapped_spheres() const { return wrapped_spheres_; }
  /// Unions of the traits and of the collision flags of all bodies.
  unsigned any_trait() const { return any_trait_; }
  int any_collision_flag() const { return any_collision_flag_; }

 private:
  struct Summary {
    unsigned traits = 0;
    int collision_flags = 0;
    std::size_t spheres = 0;
    std::size_t wrapped_spheres = 0;
  };

  PackedBody state(SphereIndex number) const {
    return copies_states_ ? states_[number] : state_of(*bodies_[number]);
  }

  bool is_current(SphereIndex number) const;
  Summary read_bodies(std::size_t begin, std::size_t end);
  std::uint8_t read_body(std::size_t number);

  PairTable table_;
  std::vector<SphereInstance> spheres_;
  std::vector<const btCollisionObject*> bodies_;
  std::vector<std::uint8_t> traits_;
  std::vector<PackedBody> states_;  ///< only if copies_states_
  bool copies_states_ = false;
  std::vector<Summary> summaries_;  ///< by chunk
  unsigned any_trait_ = 0;
  int any_collision_flag_ = 0;
  int special_flags_ = 0;
  std::size_t wrapped_spheres_ = 0;
  std::size_t expected_contacts_ = 0;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
