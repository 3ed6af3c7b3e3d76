/// Commit of pairs one at a time in Bullet's order, for dispatches whose order is observable.
#pragma once

#include "src/bullet/dispatch/unordered_commit.hpp"

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>

#include <cstdint>
#include <functional>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// One traversal of all pairs by the pair cache itself, so that the order is Bullet's for every
/// class of cache. A touching pair of spheres is written in place, and the callbacks are called as
/// Bullet's algorithm calls them, and so are spheres with boxes, planes and concave shapes. All
/// pairs that no callback observes are updated as in any other order. Bullet's algorithms process
/// the other pairs, and pairs of spheres that user code has changed since the test of the batch;
/// after a change of the pair cache, they process all.
class OrderedCommit {
 public:
  /// Called after the visit of each sphere pair. `current` is true if the manifold matches the
  /// contacts, and false if a filter may have prevented its update, or a callback changed the
  /// point.
  using Visited = std::function<void(std::size_t i, bool current)>;

  /// Determines the action for each pair from the current manifolds. `may_override_filter`: the
  /// dispatcher's class may override needsCollision(). Only this function itself can throw.
  CommitCounts plan(const SphereBatch& batch, std::span<const PairContact> touching,
                    bool may_override_filter);
  /// @param convex null if Bullet must process all pairs but those of two spheres
  /// @return the numbers of manifolds updated; those of plan() are 0
  CommitCounts run(btCollisionDispatcher& dispatcher, btOverlappingPairCache& cache,
                   const btDispatcherInfo& info, btDispatcher* argument, const SphereBatch& batch,
                   std::span<const btBroadphasePair> pairs, std::span<const PairContact> touching,
                   const ConvexDispatch* convex, const Visited& visited);

  /// For a near callback: processes the pair like btCollisionDispatcher::defaultNearCallback, from
  /// the batch if run() of this dispatcher is running on the calling thread.
  static void process_default(btBroadphasePair& pair, btCollisionDispatcher& dispatcher,
                              const btDispatcherInfo& info);
  /// The number of calls of process_default() on the calling thread.
  static std::uint64_t default_calls() { return default_calls_; }
  /// Before Bullet runs a dispatch on this thread: run() may have been left by longjmp().
  static void forget_running() {
    running_ = nullptr;
    ++stock_dispatches_;
  }

 private:
  enum class Action : std::uint8_t {
    stock,   ///< not two spheres, or a pair without Bullet's own sphere-sphere algorithm
    skip,    ///< does not touch and has no points, so nothing changes unless user code does
    filter,  ///< like skip, but a user-defined collision filter must be called
    commit,  ///< touches or has points
  };
  class Walk;

  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  static thread_local Walk* running_;
  static thread_local std::uint64_t default_calls_;
  static thread_local std::uint64_t stock_dispatches_;  ///< of dispatchers of jfpx, by Bullet

  std::vector<Action> actions_;
  std::vector<std::uint32_t> contacts_;  ///< by pair: the index of its contact, or kNone
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
