/// The dispatcher that puts jfpx into a Bullet program: one line changes, every bit stays.
#pragma once

#include <jfpx/bullet/abi.hpp>
#include <jfpx/bullet/dispatch_stats.hpp>
#include <jfpx/bullet/fused.hpp>
#include <jfpx/sphere_collider.hpp>

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>

#include <memory>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

struct DispatcherOptions {
  SphereColliderOptions collider = {};  ///< who tests the sphere pairs
  /// Pairs below which a dispatch is left to Bullet. A gas, the worst case, since nothing touches
  /// and Bullet is quick to say so, breaks even below 100 pairs; there is little to win before 256.
  std::size_t minimum_batch = 256;
  bool verify = false;  ///< as set_verify()
  /// Leave it as it is: tells how the program is compiled. If so, stats().warning says it.
  bool fuses_products = bullet::fuses_products();
};

/// A btCollisionDispatcher that tests all sphere-sphere pairs at once. Manifolds, their order,
/// every field of every point, callbacks and so trajectories are those of btCollisionDispatcher,
/// bit for bit. No create function is registered: the pairs keep Bullet's own algorithms.
///
/// Not noticed, in contrast to Bullet: a callback that moves bodies, changes radii, writes into
/// manifolds of other pairs or changes the pair cache while a dispatch is running.
///
/// Programs that include Bullet's headers need -ffp-contract=off, which linking jfpx::bullet adds.
/// As in Bullet, one thread at a time; different dispatchers are independent.
class JFPX_API CollisionDispatcher : public btCollisionDispatcher {
 public:
  /// @throws BackendUnavailable if options.collider asks for a backend by name that can't be had;
  ///   InvalidArgument for a bad option; BuildMismatch (build.hpp).
  explicit CollisionDispatcher(btCollisionConfiguration* configuration,
                               const DispatcherOptions& options = {});
  /// Uses the given collider; of options.collider only `headers` and `threads` count.
  /// @throws InvalidArgument if `collider` is null, or for more than 256 threads.
  CollisionDispatcher(btCollisionConfiguration* configuration,
                      std::unique_ptr<SphereCollider> collider,
                      const DispatcherOptions& options = {});
  ~CollisionDispatcher() override;
  CollisionDispatcher(const CollisionDispatcher&) = delete;
  CollisionDispatcher& operator=(const CollisionDispatcher&) = delete;

  /// As in Bullet, for any pair cache. If the collider throws, x86 tests the pairs of this call and
  /// of all later ones, with the same bits, and stats().device_failure says why.
  void dispatchAllCollisionPairs(btOverlappingPairCache* pair_cache,
                                 const btDispatcherInfo& dispatch_info,
                                 btDispatcher* dispatcher) override;
  /// As in Bullet; also forgets what was remembered of the manifold.
  void releaseManifold(btPersistentManifold* manifold) override;

  std::size_t minimum_batch() const noexcept;
  void set_minimum_batch(std::size_t pairs) noexcept;

  /// Recompute every pair of a batch that was not left to Bullet with Bullet's own algorithm,
  /// compare all fields, count in stats(). Slow. Global contact callbacks are taken off meanwhile:
  /// no other thread may use Bullet then. User-set combine callbacks are called twice.
  void set_verify(bool on) noexcept;
  bool verify() const noexcept;

  /// Who tested the last batch of sphere pairs.
  Backend backend() const noexcept;
  /// Why that one did.
  ChoiceReason reason() const noexcept;

  const DispatchStats& stats() const noexcept;
  void reset_stats();  ///< keeps `failure` and `device_failure`: what failed stays given up

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
