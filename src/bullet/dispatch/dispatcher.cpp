/// The public dispatcher: runs a batch if the engine supports it, and otherwise Bullet's dispatch.
#include <jfpx/bullet/dispatcher.hpp>

#include "src/bullet/dispatch/batch_engine.hpp"
#include "src/bullet/exact_class.hpp"

#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

struct CollisionDispatcher::Impl {
  BatchEngine engine;
};

CollisionDispatcher::CollisionDispatcher(CallerIsFused caller,
                                         btCollisionConfiguration* configuration,
                                         std::unique_ptr<SphereCollider> collider,
                                         const DispatcherOptions& options)
    : btCollisionDispatcher(configuration),
      impl_(new Impl{BatchEngine(std::move(collider), options)}) {
  if (caller.value) impl_->engine.warn_of_fused_products();
}

CollisionDispatcher::~CollisionDispatcher() = default;

void CollisionDispatcher::dispatchAllCollisionPairs(btOverlappingPairCache* pair_cache,
                                                    const btDispatcherInfo& dispatch_info,
                                                    btDispatcher* dispatcher) {
  const bool subclass = !is_exactly<CollisionDispatcher>(*this);
  const DispatcherTraits traits{.may_override_filter = subclass, .reports_releases = !subclass};
  if (!impl_->engine.dispatch(*this, traits, *pair_cache, dispatch_info, dispatcher)) {
    btCollisionDispatcher::dispatchAllCollisionPairs(pair_cache, dispatch_info, dispatcher);
  }
}

void CollisionDispatcher::releaseManifold(btPersistentManifold* manifold) {
  impl_->engine.note_release(manifold);
  btCollisionDispatcher::releaseManifold(manifold);
}

void CollisionDispatcher::defaultNearCallback(btBroadphasePair& pair,
                                              btCollisionDispatcher& dispatcher,
                                              const btDispatcherInfo& info) {
  OrderedCommit::process_default(pair, dispatcher, info);
}

std::size_t CollisionDispatcher::minimum_batch() const noexcept {
  return impl_->engine.minimum_batch();
}
void CollisionDispatcher::set_minimum_batch(std::size_t pairs) noexcept {
  impl_->engine.set_minimum_batch(pairs);
}
bool CollisionDispatcher::verify() const noexcept { return impl_->engine.verify(); }
void CollisionDispatcher::set_verify(bool on) noexcept { impl_->engine.set_verify(on); }
Backend CollisionDispatcher::backend() const noexcept { return impl_->engine.backend(); }
ChoiceReason CollisionDispatcher::reason() const noexcept { return impl_->engine.reason(); }
const DispatchStats& CollisionDispatcher::stats() const noexcept { return impl_->engine.stats(); }
void CollisionDispatcher::reset_stats() { impl_->engine.reset_stats(); }

std::string_view to_string(Fallback fallback) noexcept {
  switch (fallback) {
    case Fallback::none:
      return "none";
    case Fallback::small_batch:
      return "small batch";
    case Fallback::no_spheres:
      return "no spheres";
    case Fallback::near_callback:
      return "near callback replaced";
    case Fallback::create_function:
      return "create function replaced";
    case Fallback::continuous:
      return "continuous dispatch";
    case Fallback::nested:
      return "nested dispatch";
    case Fallback::out_of_memory:
      return "out of memory";
    case Fallback::rounding:
      return "rounding mode";
  }
  return "unknown";
}

std::string_view to_string(OrderReason reason) noexcept {
  switch (reason) {
    case OrderReason::none:
      return "none";
    case OrderReason::contact_callback:
      return "contact callback";
    case OrderReason::combine_callback:
      return "combine callback";
    case OrderReason::processed_callback:
      return "contact processed callback";
    case OrderReason::added_callback:
      return "contact added callback";
    case OrderReason::filter:
      return "filter overridden";
    case OrderReason::pair_cache:
      return "pair cache of another class";
    case OrderReason::near_callback:
      return "near callback";
  }
  return "unknown";
}

std::string_view to_string(ConcaveFallback fallback) noexcept {
  switch (fallback) {
    case ConcaveFallback::none:
      return "none";
    case ConcaveFallback::concave_class:
      return "class of the concave shape";
    case ConcaveFallback::convex_class:
      return "class of the convex shape";
    case ConcaveFallback::create_function:
      return "create function for triangles replaced";
    case ConcaveFallback::separating_axes:
      return "separating axes";
    case ConcaveFallback::not_finite:
      return "not finite";
    case ConcaveFallback::verified:
      return "verified";
  }
  return "unknown";
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
