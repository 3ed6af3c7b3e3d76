/// The read-only pre-pass of a dispatch: the bodies and pairs of one pair cache, as they are now.
#pragma once

#include <jfpx/sphere_collider.hpp>

#include "src/bullet/dispatch/packed_body.hpp"
#include "src/bullet/dispatch/pair_mirror.hpp"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>

#include <algorithm>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// What the dispatch needs to know of a body beside its sphere.
enum BodyTrait : std::uint8_t {
  kSphere = 1,
  kActive = 2,
  /// Its class may override btCollisionObject::checkCollideWithOverride, and it would be called.
  kOverridesFilter = 4,
  kBox = 8,              ///< exactly a btBoxShape
  kPlane = 16,           ///< exactly a btStaticPlaneShape
  kHasIgnoreList = 32,   ///< it has a list of bodies to ignore, or a filter: it must be asked
  kCustomMaterial = 64,  ///< its contacts need more than write_contact()
};

/// The first of the contacts that belong to pair `pair` or a later one.
inline const PairContact* first_contact(std::span<const PairContact> touching, std::size_t pair) {
  return std::lower_bound(
      touching.data(), touching.data() + touching.size(), pair,
      [](const PairContact& contact, std::size_t i) { return contact.pair < i; });
}

class SphereBatch {
 public:
  /// Contacts to be expected. Where bodies have several, what contacts need of them is copied, once
  /// for all; where few have any, it is read when it is needed.
  void expect_contacts(std::size_t contacts) { expected_contacts_ = contacts; }
  /// Reads the bodies of `pairs`. False if there are no two spheres among them.
  bool gather(std::span<const btBroadphasePair> pairs, const PairOwner& owner, ThreadPool& pool);
  void forget(const btPersistentManifold* manifold) noexcept { mirror_.forget(manifold); }
  /// After gather() has thrown, or where it should read everything anew.
  void forget_all() noexcept { mirror_.forget_all(); }

  /// One entry a body. Bodies that are not spheres have a radius of NaN, so that any pair with one
  /// "touches" and is sorted out where touching pairs are handled: looking at every pair before
  /// costs more.
  std::span<const SphereInstance> spheres() const { return spheres_; }
  std::span<const SpherePair> pairs() const { return mirror_.pairs(); }

  PairKind kind(std::size_t i) const { return mirror_.kind(i); }
  /// The manifold of pair i; null for PairKind::other.
  btPersistentManifold* manifold(std::size_t i) const { return mirror_.manifold(i); }
  const btCollisionObject* body_a(std::size_t i) const { return bodies_[pairs()[i].a]; }
  const btCollisionObject* body_b(std::size_t i) const { return bodies_[pairs()[i].b]; }
  BodyState state_a(std::size_t i) const { return state(pairs()[i].a); }
  BodyState state_b(std::size_t i) const { return state(pairs()[i].b); }
  /// Asks for what the contact of pair i needs of its bodies.
  void prefetch_states(std::size_t i) const;
  Real radius_b(std::size_t i) const { return spheres_[pairs()[i].b].radius; }
  bool both_are_spheres(std::size_t i) const { return (trait_a(i) & trait_b(i) & kSphere) != 0; }
  std::uint8_t trait_a(std::size_t i) const { return traits_[pairs()[i].a]; }
  std::uint8_t trait_b(std::size_t i) const { return traits_[pairs()[i].b]; }
  /// The traits that either body of pair i has.
  unsigned either_trait(std::size_t i) const {
    return static_cast<unsigned>(trait_a(i) | trait_b(i));
  }
  /// The traits, and the collision flags, that any body has.
  unsigned any_trait() const { return any_trait_; }
  int any_collision_flag() const { return any_collision_flag_; }

 private:
  struct Summary {
    unsigned traits = 0;
    int collision_flags = 0;
    std::size_t spheres = 0;
  };

  BodyState state(SphereIndex number) const {
    return copies_states_ ? states_[number] : state_of(*bodies_[number]);
  }

  Summary read_bodies(std::size_t begin, std::size_t end);
  std::uint8_t read_body(std::size_t number);

  PairMirror mirror_;
  std::vector<SphereInstance> spheres_;
  std::vector<const btCollisionObject*> bodies_;
  std::vector<std::uint8_t> traits_;
  std::vector<BodyState> states_;  ///< if copies_states_
  bool copies_states_ = false;
  std::vector<Summary> summaries_;  ///< by chunk
  unsigned any_trait_ = 0;
  int any_collision_flag_ = 0;
  int special_flags_ = 0;
  std::size_t expected_contacts_ = 0;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
