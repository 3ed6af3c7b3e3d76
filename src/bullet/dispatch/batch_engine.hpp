/// What turns a dispatch into a batch, for any btCollisionDispatcher.
#pragma once

#include <jfpx/bullet/dispatcher.hpp>

#include "src/bullet/dispatch/convex_check.hpp"
#include "src/bullet/dispatch/ordered_commit.hpp"
#include "src/bullet/dispatch/unordered_commit.hpp"

#include <memory>
#include <span>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// What the engine must know of the class of a dispatcher.
struct DispatcherTraits {
  bool may_override_filter;  ///< needsCollision must be asked about every pair
  bool tells_releases;       ///< forget() is called for every manifold that it releases
};

/// Any engine can serve any dispatcher: what it keeps from one dispatch to the next is checked
/// before it is used. One dispatch at a time.
class JFPX_API BatchEngine {
 public:
  /// @throws InvalidArgument if `collider` is null.
  BatchEngine(std::unique_ptr<SphereCollider> collider, const DispatcherOptions& options);

  /// Does what dispatcher.btCollisionDispatcher::dispatchAllCollisionPairs would do.
  /// @return false if this dispatch must be left to Bullet: nothing was done, and stats().
  ///   last_fallback says why.
  bool dispatch(btCollisionDispatcher& dispatcher, const DispatcherTraits& traits,
                btOverlappingPairCache& cache, const btDispatcherInfo& info,
                btDispatcher* argument);
  /// The dispatcher is about to release a manifold.
  void forget(const btPersistentManifold* manifold) noexcept { batch_.forget(manifold); }

  std::size_t minimum_batch() const noexcept { return minimum_batch_; }
  void set_minimum_batch(std::size_t pairs) noexcept { minimum_batch_ = pairs; }
  bool verify() const noexcept { return verify_; }
  void set_verify(bool on) noexcept { verify_ = on; }
  Backend backend() const noexcept { return collider_->backend(); }
  ChoiceReason reason() const noexcept { return collider_->reason(); }
  const DispatchStats& stats() const noexcept { return stats_; }
  void reset_stats();

 private:
  Fallback reason_to_fall_back(const btCollisionDispatcher& dispatcher, std::size_t pairs,
                               const btDispatcherInfo& info) const;
  bool prepare(btCollisionDispatcher& dispatcher, const DispatcherTraits& traits,
               btOverlappingPairCache& cache, Fallback* fallback);
  void find_touching();
  void commit(btCollisionDispatcher& dispatcher, btOverlappingPairCache& cache,
              const btDispatcherInfo& info, btDispatcher* argument);
  void commit_quietly(btCollisionDispatcher& dispatcher, btOverlappingPairCache& cache,
                      const btDispatcherInfo& info);
  void visit_left(btCollisionDispatcher& dispatcher, btOverlappingPairCache& cache,
                  const btDispatcherInfo& info);
  void add(const CommitCounts& counts);
  void check(btCollisionDispatcher& dispatcher, const btDispatcherInfo& info, std::size_t i,
             bool current);
  void check_convex(btCollisionDispatcher& dispatcher, const btDispatcherInfo& info);
  void note(const std::optional<FieldDifference>& difference);

  std::unique_ptr<SphereCollider> collider_;
  std::size_t minimum_batch_;
  bool verify_;
  bool running_ = false;
  ThreadPool pool_;
  SphereBatch batch_;
  UnorderedCommit quiet_commit_;
  OrderedCommit ordered_commit_;
  ConvexCheck convex_check_;  ///< of set_verify()
  DispatchStats stats_;
  // Of the dispatch that is running:
  std::span<const btBroadphasePair> pairs_;
  std::span<const PairContact> touching_;
  bool quiet_ = false;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
