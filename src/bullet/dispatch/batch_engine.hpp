/// Batched dispatch of all pairs of a pair cache, for any btCollisionDispatcher.
#pragma once

#include <jfpx/bullet/dispatcher.hpp>

#include "src/bullet/dispatch/convex_check.hpp"
#include "src/bullet/dispatch/ordered_commit.hpp"
#include "src/bullet/dispatch/unordered_commit.hpp"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Properties of the class of a dispatcher.
struct DispatcherTraits {
  bool may_override_filter;  ///< needsCollision() must be called for every pair
  bool reports_releases;     ///< note_release() is called for every released manifold
};

/// Runs dispatches as batches. One engine may serve several dispatchers, one call at a time,
/// because it validates the state of earlier dispatches before use.
class JFPX_BULLET_API BatchEngine {
 public:
  /// @throws InvalidArgument if `collider` is null.
  BatchEngine(std::unique_ptr<SphereCollider> collider, const DispatcherOptions& options);

  /// Has the effect of dispatcher.btCollisionDispatcher::dispatchAllCollisionPairs.
  /// @param argument the dispatcher argument for the traversal of the pair cache
  /// @return false if Bullet must run this dispatch: no body or manifold has been changed, and
  ///   stats().last_fallback is the reason
  bool dispatch(btCollisionDispatcher& dispatcher, const DispatcherTraits& traits,
                btOverlappingPairCache& cache, const btDispatcherInfo& info,
                btDispatcher* argument);
  /// Must be called before the dispatcher releases a manifold.
  void note_release(const btPersistentManifold* manifold) noexcept {
    batch_.note_release(manifold);
  }

  std::size_t minimum_batch() const noexcept { return minimum_batch_; }
  void set_minimum_batch(std::size_t pairs) noexcept { minimum_batch_ = pairs; }
  bool verify() const noexcept { return verify_; }
  void set_verify(bool on) noexcept { verify_ = on; }
  Backend backend() const noexcept { return collider_->backend(); }
  ChoiceReason reason() const noexcept { return collider_->reason(); }
  const DispatchStats& stats() const noexcept { return stats_; }
  void reset_stats();
  /// Sets stats().warning, which reset_stats() keeps.
  void warn_of_fused_products();

 private:
  Fallback reason_to_fall_back(const btCollisionDispatcher& dispatcher, std::size_t pairs,
                               const btDispatcherInfo& info) const;
  bool prepare(btCollisionDispatcher& dispatcher, const DispatcherTraits& traits,
               btOverlappingPairCache& cache, Fallback* fallback);
  bool find_few_active();
  void find_touching();
  void commit(btCollisionDispatcher& dispatcher, btOverlappingPairCache& cache,
              const btDispatcherInfo& info, btDispatcher* argument);
  ConvexDispatch convex_dispatch(btCollisionDispatcher& dispatcher, const btDispatcherInfo& info);
  void commit_unordered(btCollisionDispatcher& dispatcher, btOverlappingPairCache& cache,
                        const btDispatcherInfo& info);
  template <class Prefetch>
  void visit(btCollisionDispatcher& dispatcher, btOverlappingPairCache& cache,
             const btDispatcherInfo& info, std::span<const std::uint32_t> chosen,
             const Prefetch& prefetch_pair);
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
  UnorderedCommit unordered_commit_;
  OrderedCommit ordered_commit_;
  TriangleAlgorithms triangle_algorithms_;
  ConvexCheck convex_check_;  ///< for set_verify()
  DispatchStats stats_;
  // State of the running dispatch:
  std::span<const btBroadphasePair> pairs_;
  std::span<const PairContact> touching_;
  OrderReason order_reason_ = OrderReason::none;
  /// Whether the near callback has called CollisionDispatcher::defaultNearCallback() since the
  /// begin of the last dispatch, so that a batch gains.
  bool near_calls_default_ = false;
  std::uint64_t default_calls_ =
      OrderedCommit::default_calls();  ///< OrderedCommit::default_calls() at that time
  bool few_are_active_ = false;        ///< Bullet processes the pairs in active_, and no others
  std::vector<std::uint32_t> active_;  ///< numbers of pairs
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
