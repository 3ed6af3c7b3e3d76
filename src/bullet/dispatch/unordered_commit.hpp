/// Commit of pairs in any order and on any thread, for dispatches whose order is unobservable.
#pragma once

#include "src/bullet/dispatch/convex_commit.hpp"

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Reason why the order of manifold updates is observable. OrderReason::none: no global callback
/// is called, Bullet's functions combine the materials, and no class that may override a filter is
/// involved.
/// `may_override_filter`: the dispatcher's class may override needsCollision().
OrderReason reason_for_order(const SphereBatch& batch, bool may_override_filter);

/// Updates the manifolds of pairs of spheres and of convex shapes. Each manifold belongs to one
/// pair, so threads share no data. Bullet creates and releases the manifolds, because the order of
/// those operations is observable.
class UnorderedCommit {
 public:
  /// Reserves memory; the only function that can throw.
  void reserve(std::size_t pairs);
  /// Updates the pairs that do not require Bullet, and lists all others in remaining().
  CommitCounts run(const ConvexDispatch& dispatch, std::span<const PairContact> touching,
                   ThreadPool& pool);
  /// The pairs that Bullet must process, in ascending order.
  std::span<std::uint32_t> remaining() { return {remaining_.data(), remaining_count_}; }
  /// Sorts ascending numbers of pairs into the order in which btHashedOverlappingPairCache visits
  /// them, with or without m_deterministicOverlappingPairs.
  static void sort(std::span<std::uint32_t> numbers, std::span<const btBroadphasePair> pairs,
                   bool deterministic);

 private:
  struct Chunk {
    CommitCounts counts;
    std::size_t remaining = 0;  ///< at the begin of the chunk's part of remaining_
  };

  CommitCounts commit_spheres(const ConvexDispatch& dispatch, std::span<const PairContact> touching,
                              ThreadPool& pool);
  CommitCounts commit_convex_pairs(const ConvexDispatch& dispatch, ThreadPool& pool);
  CommitCounts collect(std::size_t chunks, std::size_t chunk_size);

  std::vector<std::uint32_t> remaining_;
  std::vector<std::uint32_t> found_;  ///< by chunk: pairs to visit
  std::size_t remaining_count_ = 0;
  std::vector<Chunk> chunks_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
