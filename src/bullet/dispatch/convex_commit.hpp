/// Update of the manifolds of pairs of convex shapes, and of convex shapes and planes.
#pragma once

#include <jfpx/bullet/dispatch_stats.hpp>

#include "src/bullet/dispatch/sphere_batch.hpp"
#include "src/bullet/dispatch/triangle_algorithms.hpp"

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>

#include <array>
#include <span>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Contribution of a commit to the statistics.
struct CommitCounts {
  std::uint64_t sphere_pairs = 0;     ///< pairs of two spheres
  std::uint64_t touching = 0;         ///< sphere pairs that the collider reported as touching
  std::uint64_t written = 0;          ///< sphere pairs updated without Bullet's algorithm
  std::uint64_t sphere_boxes = 0;     ///< sphere-box pairs updated without Bullet's algorithm
  std::uint64_t sphere_planes = 0;    ///< sphere-plane pairs updated without Bullet's algorithm
  std::uint64_t convex_pairs = 0;     ///< other pairs of convex shapes, and of these and planes
  std::uint64_t sphere_concaves = 0;  ///< spheres on concave shapes, without Bullet's algorithm
  std::uint64_t concave_pairs = 0;    ///< other convex shapes on concave shapes
  std::uint64_t compound_pairs = 0;  ///< pairs with compounds, without Bullet's compound algorithms
  std::array<std::uint64_t, kConcaveFallbackCount> concave_fallbacks{};  ///< by reason

  CommitCounts& operator+=(const CommitCounts& other);
};

/// Common arguments of the pairs of a dispatch.
struct ConvexDispatch {
  btCollisionDispatcher& dispatcher;
  const btDispatcherInfo& info;
  const SphereBatch& batch;
  std::span<const btBroadphasePair> pairs;
  /// Whether Bullet's own algorithms may run on the calling thread.
  bool runs_algorithms;
  const TriangleAlgorithms& triangle_algorithms;
  /// See TriangleAlgorithms::ignores_separated().
  bool ignores_separated;
};

/// Prefetches what commit_convex() reads. prefetch_algorithm(), for a later pair, prefetches what
/// prefetch_convex() reads.
void prefetch_convex(const ConvexDispatch& dispatch, std::size_t i);
void prefetch_algorithm(const ConvexDispatch& dispatch, std::size_t i);

/// Updates the manifold of pair i on the calling thread, if neither other pairs nor user code can
/// observe the update: the algorithm and both shapes must be exactly classes of Bullet whose
/// functions only read the bodies and write the manifold of the pair. Spheres with planes, and the
/// pairs of find_closest_points(), are computed without Bullet's algorithm.
/// @return false if Bullet must process the pair
bool commit_convex(const ConvexDispatch& dispatch, std::size_t i, CommitCounts* counts);

/// The same for a pair that needs a collision, on the thread that dispatches; reads the current
/// shapes. No callback may observe the pair.
bool commit_unobserved(const ConvexDispatch& dispatch, std::size_t i, CommitCounts* counts);

/// Whether the shapes, whose traits are `a` and `b`, are those for which an algorithm of this kind
/// was created, because the user may have replaced one since. False for PairKind::other and
/// PairKind::spheres.
bool has_expected_shapes(PairKind kind, const btCollisionShape& shape_a, unsigned a,
                         const btCollisionShape& shape_b, unsigned b);

/// Whether commit_in_order() may process pair i: a sphere with a box, a plane, or a concave shape.
/// Reads the current shapes of the bodies.
bool has_sphere(const SphereBatch& batch, std::size_t i);
/// Has the effect of the algorithm of pair i, also on callbacks, on the thread that dispatches.
void commit_in_order(const ConvexDispatch& dispatch, std::size_t i, CommitCounts* counts);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
