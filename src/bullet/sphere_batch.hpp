/// The read-only pre-pass of a dispatch: the bodies and pairs of one pair cache, as they are now.
#pragma once

#include <jfpx/sphere_collider.hpp>

#include "src/bullet/pair_mirror.hpp"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>

#include <vector>

namespace jfpx::inline JFPX_ABI::bullet {

/// What the dispatch needs to know of a body beside its sphere.
enum BodyTrait : std::uint8_t {
  kSphere = 1,
  kActive = 2,
  /// Its class may override btCollisionObject::checkCollideWithOverride, and it would be called.
  kForeign = 4,
  kBox = 8,     ///< exactly a btBoxShape
  kPlane = 16,  ///< exactly a btStaticPlaneShape
};

class SphereBatch {
 public:
  /// Reads the bodies of `pairs`. False if there are no two spheres among them.
  bool gather(std::span<const btBroadphasePair> pairs, const PairOwner& owner,
              x86::ThreadPool& pool);
  void forget(const btPersistentManifold* manifold) noexcept { mirror_.forget(manifold); }

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

  Summary read_bodies(std::size_t begin, std::size_t end);
  std::uint8_t read_body(std::size_t number);

  PairMirror mirror_;
  std::vector<SphereInstance> spheres_;
  std::vector<const btCollisionObject*> bodies_;
  std::vector<std::uint8_t> traits_;
  std::vector<Summary> summaries_;  ///< by chunk
  unsigned any_trait_ = 0;
  int any_collision_flag_ = 0;
};

}  // namespace jfpx::inline JFPX_ABI::bullet
