/// Drop-in replacement for btCollisionDispatcher with bit-identical results.
#pragma once

#include <jfpx/bullet/abi.hpp>
#include <jfpx/bullet/dispatch_stats.hpp>
#include <jfpx/bullet/fused.hpp>
#include <jfpx/sphere_collider.hpp>

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>

#include <memory>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

class SceneWorld;

struct DispatcherOptions {
  SphereColliderOptions collider = {};  ///< the collider that tests the sphere pairs
  /// Dispatches of fewer pairs run in Bullet's own code. Below 256 pairs, the gain is small; from
  /// about 100 pairs on, a batch is no slower than Bullet's code in any measured scene.
  std::size_t minimum_batch = 256;
  bool verify = false;  ///< see set_verify()
};

/// A btCollisionDispatcher that computes the pairs of a dispatch in one batch. It tests all pairs
/// of two spheres on the CPU or a GPU. It also computes pairs of a sphere with a btBoxShape, a
/// btStaticPlaneShape or a terrain, and of spheres in compounds, and runs Bullet's algorithms for
/// the other pairs of boxes, capsules, cylinders, cones, spheres, planes, multi-spheres, and convex
/// hulls without polyhedral features: on all threads, unless a callback or an overridden filter can
/// observe the order of the pairs. Bullet computes the pairs of all other shapes.
///
/// Manifolds, their order, every field of every point, callbacks, and therefore trajectories are
/// those of btCollisionDispatcher, bit for bit. No create function is registered: the pairs keep
/// Bullet's own algorithms. Callbacks and filters may change bodies, manifolds and the pair cache
/// during a dispatch, as far as Bullet allows it.
///
/// Programs that include Bullet's headers need -ffp-contract=off, which linking jfpx::bullet adds;
/// stats().warning reports a program that is compiled otherwise. As in Bullet, only one thread at a
/// time may use a dispatcher; different dispatchers are independent.
class JFPX_BULLET_API CollisionDispatcher : public btCollisionDispatcher {
 public:
  // The constructors are inlined into the program, to check how it is compiled.

  /// @throws BackendUnavailable if options.collider names a backend that is unavailable;
  ///   InvalidArgument for an invalid option.
  [[gnu::always_inline]] explicit CollisionDispatcher(btCollisionConfiguration* configuration,
                                                      const DispatcherOptions& options = {})
      : CollisionDispatcher(CallerIsFused{fuses_products()}, configuration,
                            make_sphere_collider(options.collider), options) {}
  /// Uses the given collider; of options.collider, only `threads` is used.
  /// @throws InvalidArgument if `collider` is null, or for more than 256 threads.
  [[gnu::always_inline]] CollisionDispatcher(btCollisionConfiguration* configuration,
                                             std::unique_ptr<SphereCollider> collider,
                                             const DispatcherOptions& options = {})
      : CollisionDispatcher(CallerIsFused{fuses_products()}, configuration, std::move(collider),
                            options) {}
  ~CollisionDispatcher() override;
  CollisionDispatcher(const CollisionDispatcher&) = delete;
  CollisionDispatcher& operator=(const CollisionDispatcher&) = delete;

  /// As in Bullet, for any pair cache. If the collider throws, the CPU tests the pairs of this call
  /// and of all later calls, with identical bits, and stats().device_failure holds the reason.
  void dispatchAllCollisionPairs(btOverlappingPairCache* pair_cache,
                                 const btDispatcherInfo& dispatch_info,
                                 btDispatcher* dispatcher) override;
  /// As in Bullet, for near callbacks of the user. Dispatches remain batches if the near callback
  /// calls this function instead of Bullet's; the first one after setNearCallback() runs in
  /// Bullet's code.
  static void defaultNearCallback(btBroadphasePair& pair, btCollisionDispatcher& dispatcher,
                                  const btDispatcherInfo& info);
  /// As in Bullet; also drops the cached reference to the manifold.
  void releaseManifold(btPersistentManifold* manifold) override;

  std::size_t minimum_batch() const noexcept;
  void set_minimum_batch(std::size_t pairs) noexcept;

  /// If on, Bullet's own algorithm recomputes every pair that jfpx has updated; all fields are
  /// compared, and stats() counts the differences. Slow. Global contact callbacks are disabled
  /// during the check, so no other thread may use Bullet during a dispatch. Combine callbacks of
  /// the user are called twice.
  void set_verify(bool on) noexcept;
  bool verify() const noexcept;

  /// Backend that tested the last batch of sphere pairs.
  Backend backend() const noexcept;
  /// Reason for the choice of that backend.
  ChoiceReason reason() const noexcept;

  const DispatchStats& stats() const noexcept;
  void reset_stats();  ///< keeps `warning` and `device_failure`, which remain true

 private:
  friend SceneWorld;
  struct Impl;
  struct CallerIsFused {
    bool value;
  };

  CollisionDispatcher(CallerIsFused caller, btCollisionConfiguration* configuration,
                      std::unique_ptr<SphereCollider> collider, const DispatcherOptions& options);

  std::unique_ptr<Impl> impl_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
