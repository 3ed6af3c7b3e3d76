/// The read-only pre-pass of a dispatch: what the collider needs to know, and what the walk over
/// the pairs will have to do.
#pragma once

#include <jfpx/sphere_collider.hpp>

#include "src/bullet/proxy_table.hpp"

#include <BulletCollision/BroadphaseCollision/btBroadphaseProxy.h>
#include <BulletCollision/BroadphaseCollision/btCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCollisionObject.h>

#include <vector>

namespace jfpx::inline JFPX_ABI::bullet {

/// What the walk does at a pair.
enum class Action : std::uint8_t {
  stock,   ///< not two spheres, or not (yet) a pair with Bullet's own sphere-sphere algorithm
  skip,    ///< does not touch and has no points: nothing could change
  ask,     ///< as skip, but a user's override of the collision filter must be asked
  commit,  ///< touches or has points
};

/// The bodies and pairs of one pair cache, as they are now. Keeps nothing between dispatches except
/// memory: bodies, algorithms and manifolds may change and move between any two calls.
class SphereBatch {
 public:
  /// Reads the bodies of `pairs`. False if there are no two spheres among them.
  bool gather(std::span<const btBroadphasePair> pairs);
  /// Decides for every pair. `results[i]` belongs to pair i; `ask_all` when the dispatcher's class
  /// may override needsCollision.
  void plan(std::span<const btBroadphasePair> pairs, std::span<const PairResult> results,
            bool ask_all);

  /// One entry a body. Bodies that are not spheres have a point at the origin, and nobody looks at
  /// the results of their pairs: sorting them out costs more than testing them.
  std::span<const SphereInstance> spheres() const { return spheres_; }
  std::span<const SpherePair> sphere_pairs() const { return pairs_; }

  const btCollisionObject* body_a(std::size_t i) const { return bodies_[pairs_[i].a]; }
  const btCollisionObject* body_b(std::size_t i) const { return bodies_[pairs_[i].b]; }
  Action action(std::size_t i) const { return actions_[i]; }
  /// What plan() counted.
  std::uint64_t sphere_pair_count() const { return sphere_pair_count_; }
  std::uint64_t touching_count() const { return touching_count_; }
  /// The manifold of pair i if Bullet's own sphere-sphere algorithm has one, else null.
  btPersistentManifold* manifold(std::size_t i) const { return manifolds_[i]; }
  /// Brings the memory that committing pair i will use into the cache.
  void prefetch_commit(std::size_t i) const;

 private:
  enum Trait : std::uint8_t {
    kSphere = 1,
    kForeign = 2,  ///< a class that may override btCollisionObject::checkCollideWithOverride
  };

  void read_bodies();
  void find_manifolds(std::span<const btBroadphasePair> pairs, std::span<const PairResult> results,
                      std::size_t begin, std::size_t end);
  btPersistentManifold* find_manifold(btCollisionAlgorithm* algorithm);

  ProxyTable table_;
  std::vector<SpherePair> pairs_;
  std::vector<SphereInstance> spheres_;
  std::vector<const btCollisionObject*> bodies_;
  std::vector<std::uint8_t> traits_;
  std::vector<Action> actions_;
  std::vector<btPersistentManifold*> manifolds_;
  btManifoldArray found_;
  std::uint64_t sphere_pair_count_ = 0, touching_count_ = 0;
};

}  // namespace jfpx::inline JFPX_ABI::bullet
