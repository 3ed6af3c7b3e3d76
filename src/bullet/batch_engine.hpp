/// What turns a dispatch into a batch, for any btCollisionDispatcher.
#pragma once

#include <jfpx/bullet/dispatcher.hpp>

#include "src/bullet/sphere_batch.hpp"

#include <memory>
#include <span>

namespace jfpx::inline JFPX_ABI::bullet {

/// Keeps nothing of a dispatcher between two dispatches, so that any engine can serve any. One
/// dispatch at a time.
class JFPX_API BatchEngine {
 public:
  /// @throws InvalidArgument if `collider` is null.
  BatchEngine(std::unique_ptr<SphereCollider> collider, const DispatcherOptions& options);

  /// Does what dispatcher.btCollisionDispatcher::dispatchAllCollisionPairs would do. `ask_all` when
  /// the dispatcher's class may override needsCollision: it must be asked about every pair then.
  /// @return false if this dispatch must be left to Bullet: nothing was done, and stats().
  ///   last_fallback says why.
  bool dispatch(btCollisionDispatcher& dispatcher, bool ask_all, btOverlappingPairCache& cache,
                const btDispatcherInfo& info, btDispatcher* argument);

  std::size_t minimum_batch() const noexcept { return minimum_batch_; }
  void set_minimum_batch(std::size_t pairs) noexcept { minimum_batch_ = pairs; }
  bool verify() const noexcept { return verify_; }
  void set_verify(bool on) noexcept { verify_ = on; }
  Backend backend() const noexcept { return collider_->backend(); }
  const DispatchStats& stats() const noexcept { return stats_; }
  void reset_stats();

 private:
  Fallback reason_to_fall_back(const btCollisionDispatcher& dispatcher, std::size_t pairs,
                               const btDispatcherInfo& info) const;
  std::span<const PairResult> prepare(std::span<const btBroadphasePair> pairs, bool ask_all,
                                      Fallback* fallback);

  std::unique_ptr<SphereCollider> collider_;
  std::size_t minimum_batch_;
  bool verify_;
  bool running_ = false;
  SphereBatch batch_;
  DispatchStats stats_;
};

}  // namespace jfpx::inline JFPX_ABI::bullet
