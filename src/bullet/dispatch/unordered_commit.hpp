/// The commit of pairs in any order and by any thread, for dispatches that nobody listens to.
#pragma once

#include "src/bullet/dispatch/sphere_batch.hpp"

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// What a commit adds to the statistics.
struct CommitCounts {
  std::uint64_t sphere_pairs = 0;   ///< pairs of two spheres
  std::uint64_t touching = 0;       ///< of these, found touching by the collider
  std::uint64_t written = 0;        ///< of these, brought up to date without Bullet's algorithm
  std::uint64_t sphere_boxes = 0;   ///< pairs of a sphere and a box, likewise
  std::uint64_t sphere_planes = 0;  ///< pairs of a sphere and a plane, likewise
};

/// True if the order in which manifolds are brought up to date can't be observed: no global
/// callback would be called, materials are combined by Bullet's functions, and no class that may
/// override a filter takes part. `ask_all` when the dispatcher's class may override needsCollision.
bool is_quiet(const SphereBatch& batch, bool ask_all);

/// Brings the manifolds of sphere pairs up to date. Each belongs to one pair, so threads share
/// nothing; creating and releasing manifolds, whose order is visible, is left to Bullet.
class UnorderedCommit {
 public:
  /// Makes room; the only part that can throw.
  void reserve(std::size_t pairs);
  /// Does what needs no order.
  CommitCounts run(btCollisionDispatcher& dispatcher, const SphereBatch& batch,
                   std::span<const PairContact> touching, ThreadPool& pool);
  /// Puts the pairs that are left to Bullet into the order in which btHashedOverlappingPairCache
  /// visits them, with and without m_deterministicOverlappingPairs.
  void sort_left(std::span<const btBroadphasePair> pairs, bool deterministic);
  std::span<const std::uint32_t> left() const { return {left_.data(), left_count_}; }

 private:
  struct Chunk {
    CommitCounts counts;
    std::size_t left = 0;
  };

  std::vector<std::uint32_t> left_;
  std::size_t left_count_ = 0;
  std::vector<Chunk> chunks_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
