/// Commit of pairs in any order and on any thread, for dispatches whose order is unobservable.
#pragma once

#include <jfpx/bullet/dispatch_stats.hpp>

#include "src/bullet/dispatch/sphere_batch.hpp"

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Contribution of a commit to the statistics.
struct CommitCounts {
  std::uint64_t sphere_pairs = 0;   ///< pairs of two spheres
  std::uint64_t touching = 0;       ///< sphere pairs that the collider reported as touching
  std::uint64_t written = 0;        ///< sphere pairs updated without Bullet's algorithm
  std::uint64_t sphere_boxes = 0;   ///< sphere-box pairs updated without Bullet's algorithm
  std::uint64_t sphere_planes = 0;  ///< sphere-plane pairs updated without Bullet's algorithm
};

/// Why the order of manifold updates is observable. OrderReason::none: no global callback would be
/// called, Bullet's functions combine the materials, and no class that may override a filter is
/// involved.
/// `may_override_filter`: the dispatcher's class may override needsCollision().
OrderReason reason_for_order(const SphereBatch& batch, bool may_override_filter);

/// Updates the manifolds of pairs of spheres, and of spheres with boxes and planes. Each manifold
/// belongs to one pair, so threads share no data. Bullet creates and releases the manifolds,
/// because the order of those operations is observable.
class UnorderedCommit {
 public:
  /// Reserves memory; the only function that can throw.
  void reserve(std::size_t pairs);
  /// Updates the pairs that do not require Bullet, and lists the others in remaining().
  CommitCounts run(btCollisionDispatcher& dispatcher, const SphereBatch& batch,
                   std::span<const PairContact> touching, ThreadPool& pool);
  /// Sorts the remaining pairs into the order in which btHashedOverlappingPairCache visits them,
  /// with or without m_deterministicOverlappingPairs.
  void sort_remaining(std::span<const btBroadphasePair> pairs, bool deterministic);
  /// The pairs that Bullet must process.
  std::span<const std::uint32_t> remaining() const { return {remaining_.data(), remaining_count_}; }

 private:
  struct Chunk {
    CommitCounts counts;
    std::size_t remaining = 0;
  };

  std::vector<std::uint32_t> remaining_;
  std::size_t remaining_count_ = 0;
  std::vector<Chunk> chunks_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
