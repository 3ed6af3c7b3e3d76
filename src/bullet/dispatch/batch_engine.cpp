/// The stages of a dispatch: a read-only pass over all pairs, the collider, and a commit with the
/// effect of Bullet's algorithms, in Bullet's order unless the order is unobservable.
#include "src/bullet/dispatch/batch_engine.hpp"

#include <jfpx/error.hpp>

#include "src/base/floating_point.hpp"
#include "src/bullet/dispatch/compound_commit.hpp"
#include "src/bullet/dispatch/contact_point.hpp"
#include "src/bullet/dispatch/pair_check.hpp"
#include "src/bullet/exact_class.hpp"
#include "src/bullet/failure.hpp"
#include "src/bullet/prefetch.hpp"

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>
#include <BulletCollision/CollisionDispatch/btSphereSphereCollisionAlgorithm.h>
#include <LinearMath/btQuickprof.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <functional>
#include <new>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

namespace {

using Clock = std::chrono::steady_clock;

double milliseconds(Clock::time_point begin, Clock::time_point end) {
  return std::chrono::duration<double, std::milli>(end - begin).count();
}

std::span<const btBroadphasePair> pairs_of(btOverlappingPairCache& cache) {
  const int n = cache.getNumOverlappingPairs();
  // Bullet asserts that the array of a cache is not empty.
  if (n <= 0) return {};
  return {cache.getOverlappingPairArrayPtr(), static_cast<std::size_t>(n)};
}

/// Sets a flag for the duration of a dispatch, even if a callback throws.
class Running {
 public:
  explicit Running(bool* flag) : flag_(flag) { *flag_ = true; }
  ~Running() { *flag_ = false; }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

 private:
  bool* flag_;
};

/// Whether Bullet's own algorithm is registered for sphere pairs. `Access` reads a protected
/// member.
bool has_stock_sphere_function(const btCollisionDispatcher& dispatcher) {
  struct Access : btCollisionDispatcher {
    static constexpr auto table() { return &Access::m_doubleDispatchContactPoints; }
  };
  const btCollisionAlgorithmCreateFunc* function =
      (dispatcher.*Access::table())[SPHERE_SHAPE_PROXYTYPE][SPHERE_SHAPE_PROXYTYPE];
  return function != nullptr && is_exactly<btSphereSphereCollisionAlgorithm::CreateFunc>(*function);
}

bool has_stock_near_callback(const btCollisionDispatcher& dispatcher) {
  return dispatcher.getNearCallback() == btNearCallback(btCollisionDispatcher::defaultNearCallback);
}

const btCollisionObject& object_of(const btBroadphaseProxy* proxy) {
  return *static_cast<const btCollisionObject*>(proxy->m_clientObject);
}

/// Whether user code that runs for a pair may activate bodies of later pairs.
bool may_activate(const btCollisionObject& a, const btCollisionObject& b) {
  return a.*BodyFields::check_collide_with != 0 || b.*BodyFields::check_collide_with != 0;
}
bool has_callbacks() {
  return contacts_are_observed() || gContactProcessedCallback != nullptr ||
         gContactAddedCallback != nullptr;
}

/// Whether pairs with concave shapes, convex shapes or compounds, or spheres in compounds, are so
/// many that a batch without other spheres gains with one thread.
bool gains_without_spheres(const SphereBatch& batch, std::span<const btBroadphasePair> pairs) {
  std::size_t wanted = 64;
  if (batch.wrapped_spheres() >= wanted) return true;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const PairKind kind = batch.kind(i);
    const bool gains = is_concave(kind) || kind == PairKind::convex ||
                       (kind == PairKind::other && is_compound_algorithm(pairs[i].m_algorithm));
    if (gains && --wanted == 0) return true;
  }
  return false;
}

}  // namespace

BatchEngine::BatchEngine(std::unique_ptr<SphereCollider> collider, const DispatcherOptions& options)
    : collider_(std::move(collider)),
      minimum_batch_(options.minimum_batch),
      verify_(options.verify),
      pool_(options.collider.threads) {
  if (collider_ == nullptr) throw InvalidArgument("collider is null; it must be a SphereCollider");
}

void BatchEngine::warn_of_fused_products() {
  stats_.warning =
      "the program, which includes Bullet's headers, is compiled with fused multiply-add, so its "
      "results differ from those of other builds; compile it with -ffp-contract=off";
}

Fallback BatchEngine::reason_to_fall_back(const btCollisionDispatcher& dispatcher,
                                          std::size_t pairs, const btDispatcherInfo& info) const {
  if (running_) return Fallback::nested;
  if (pairs == 0 || pairs < minimum_batch_) return Fallback::small_batch;
  if (!rounds_to_nearest()) return Fallback::rounding;
  if (!has_stock_near_callback(dispatcher) && !near_calls_default_) {
    return Fallback::near_callback;
  }
  if (!has_stock_sphere_function(dispatcher)) return Fallback::create_function;
  if (info.m_dispatchFunc != btDispatcherInfo::DISPATCH_DISCRETE) return Fallback::continuous;
  return Fallback::none;
}

/// Runs all stages before the commit, and all operations that may throw. Returns false and sets
/// `*fallback` if a batch without spheres gains nothing, or if an operation failed.
/// find_touching() handles failures of a device.
bool BatchEngine::prepare(btCollisionDispatcher& dispatcher, const DispatcherTraits& traits,
                          btOverlappingPairCache& cache, Fallback* fallback) {
  const TrapsMasked masked;
  try {
    few_are_active_ = !traits.may_override_filter && has_stock_near_callback(dispatcher) &&
                      is_exactly<btHashedOverlappingPairCache>(cache) && find_few_active();
    if (few_are_active_) {
      order_reason_ = OrderReason::none;
      return true;
    }
    const std::size_t spheres =
        batch_.gather(pairs_, {&dispatcher, traits.reports_releases}, pool_);
    // Most pairs of other shapes gain only from several threads.
    if (spheres < 2 && pool_.threads() == 1 && !gains_without_spheres(batch_, pairs_)) {
      *fallback = Fallback::no_spheres;
      return false;
    }
    order_reason_ = reason_for_order(batch_, traits.may_override_filter);
    if (order_reason_ == OrderReason::none && !has_stock_near_callback(dispatcher)) {
      order_reason_ = OrderReason::near_callback;
    }
    // A user-defined pair cache may observe the traversal itself.
    if (order_reason_ == OrderReason::none && !is_exactly<btHashedOverlappingPairCache>(cache)) {
      order_reason_ = OrderReason::pair_cache;
    }
    touching_ = {};
    if (spheres >= 2) find_touching();
    if (order_reason_ == OrderReason::none) {
      unordered_commit_.reserve(pairs_.size());
    } else {
      add(ordered_commit_.plan(batch_, touching_, traits.may_override_filter));
    }
    return true;
  } catch (const std::exception& error) {
    stats_.failure = message_of(error);
    batch_.invalidate();
    *fallback = Fallback::out_of_memory;
    return false;
  }
}

/// If the collider fails, for example because its device is lost, a CPU collider replaces it
/// permanently. A CPU collider that runs out of memory is kept and retried in the next dispatch.
void BatchEngine::find_touching() {
  try {
    touching_ = collider_->find_touching(batch_.spheres(), batch_.pairs());
    batch_.expect_contacts(touching_.size());
    const TransferredBytes bytes = collider_->transferred();
    stats_.to_device += bytes.to_device;
    stats_.from_device += bytes.from_device;
    if (const auto why = collider_->device_failure(); !why.empty()) stats_.device_failure = why;
  } catch (const std::exception& error) {
    const bool on_cpu = !stats_.device_failure.empty() || collider_->backend() == Backend::cpu;
    if (on_cpu && is_out_of_memory(error)) throw;
    stats_.device_failure = message_of(error);
    collider_ = make_sphere_collider({.backend = Backend::cpu, .threads = pool_.threads()});
    touching_ = collider_->find_touching(batch_.spheres(), batch_.pairs());
  }
}

/// Lists the pairs with an active body. Bullet does not process the others, which no callback can
/// observe. Returns false at the first pair that is too many for visits one after the other.
bool BatchEngine::find_few_active() {
  active_.clear();
  active_.reserve(std::min(minimum_batch_, pairs_.size()));
  const bool any_callback = has_callbacks();
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const btCollisionObject &a = object_of(pairs_[i].m_pProxy0),
                            &b = object_of(pairs_[i].m_pProxy1);
    if (!a.isActive() && !b.isActive()) continue;
    if (active_.size() >= minimum_batch_ || any_callback || may_activate(a, b)) return false;
    active_.push_back(static_cast<std::uint32_t>(i));
  }
  return true;
}

bool BatchEngine::dispatch(btCollisionDispatcher& dispatcher, const DispatcherTraits& traits,
                           btOverlappingPairCache& cache, const btDispatcherInfo& info,
                           btDispatcher* argument) {
  ++stats_.dispatches;
  const std::span<const btBroadphasePair> pairs = pairs_of(cache);
  const std::uint64_t default_calls = OrderedCommit::default_calls();
  near_calls_default_ = default_calls != std::exchange(default_calls_, default_calls);
  Fallback fallback = reason_to_fall_back(dispatcher, pairs.size(), info);
  const auto start = fallback == Fallback::none ? Clock::now() : Clock::time_point{};
  if (fallback == Fallback::none) {
    pairs_ = pairs;
    prepare(dispatcher, traits, cache, &fallback);
  }
  stats_.last_fallback = fallback;
  if (fallback != Fallback::none) {
    ++stats_.fallbacks[static_cast<std::size_t>(fallback)];
    OrderedCommit::forget_running();
    return false;
  }
  ++stats_.batches;
  ++stats_.ordered[static_cast<std::size_t>(order_reason_)];
  stats_.last_order = order_reason_;
  stats_.pairs += pairs.size();
  const auto prepared = Clock::now();
  commit(dispatcher, cache, info, argument);
  stats_.prepare_ms += milliseconds(start, prepared);
  stats_.commit_ms += milliseconds(prepared, Clock::now());
  return true;
}

void BatchEngine::commit(btCollisionDispatcher& dispatcher, btOverlappingPairCache& cache,
                         const btDispatcherInfo& info, btDispatcher* argument) {
  const Running running(&running_);
  BT_PROFILE("processAllOverlappingPairs");
  if (few_are_active_) {
    UnorderedCommit::sort(active_, pairs_, info.m_deterministicOverlappingPairs);
    visit(dispatcher, cache, info, active_, [](std::size_t) {});
    return;
  }
  if (order_reason_ == OrderReason::none) {
    commit_unordered(dispatcher, cache, info);
    return;
  }
  const auto verify = [&](std::size_t i, bool current) { check(dispatcher, info, i, current); };
  OrderedCommit::Visited visited;
  if (verify_) visited = std::ref(verify);  // std::ref avoids an allocation
  const ConvexDispatch convex = convex_dispatch(dispatcher, info);
  // Traps could be raised by operations that Bullet does not execute.
  const bool uses_convex = !verify_ && traps_are_masked();
  add(ordered_commit_.run(dispatcher, cache, info, argument, batch_, pairs_, touching_,
                          uses_convex ? &convex : nullptr, visited));
}

ConvexDispatch BatchEngine::convex_dispatch(btCollisionDispatcher& dispatcher,
                                            const btDispatcherInfo& info) {
  triangle_algorithms_.read(dispatcher);
  // set_verify() runs Bullet's algorithms itself, to compare the results with those of jfpx.
  return {.dispatcher = dispatcher,
          .info = info,
          .batch = batch_,
          .pairs = pairs_,
          .runs_algorithms = !verify_,
          .triangle_algorithms = triangle_algorithms_,
          .ignores_separated = TriangleAlgorithms::ignores_separated()};
}

void BatchEngine::commit_unordered(btCollisionDispatcher& dispatcher, btOverlappingPairCache& cache,
                                   const btDispatcherInfo& info) {
  const std::size_t n = pairs_.size();
  if (verify_) convex_check_.remember(batch_);
  const ConvexDispatch dispatch = convex_dispatch(dispatcher, info);
  {
    const TrapsMasked masked;
    add(unordered_commit_.run(dispatch, touching_, pool_));
  }
  if (verify_) check_convex(dispatcher, info);
  const std::span<std::uint32_t> remaining = unordered_commit_.remaining();
  UnorderedCommit::sort(remaining, pairs_, info.m_deterministicOverlappingPairs);
  visit(dispatcher, cache, info, remaining, [&](std::size_t i) {
    prefetch_for_contact(*batch_.body_a(i));
    prefetch_for_contact(*batch_.body_b(i));
    if (batch_.manifold(i) == nullptr) return;
    prefetch_header(batch_.manifold(i));
    prefetch_first_point(batch_.manifold(i));
  });
  if (!verify_) return;
  for (std::size_t i = 0; i < n; ++i) {
    if (batch_.kind(i) != PairKind::spheres || !batch_.both_are_spheres(i)) continue;
    check(dispatcher, info, i, dispatcher.needsCollision(batch_.body_a(i), batch_.body_b(i)));
  }
}

/// Passes the chosen pairs, and those that are added meanwhile, to Bullet's near callback.
template <class Prefetch>
void BatchEngine::visit(btCollisionDispatcher& dispatcher, btOverlappingPairCache& cache,
                        const btDispatcherInfo& info, std::span<const std::uint32_t> chosen,
                        const Prefetch& prefetch_pair) {
  constexpr std::size_t kAhead = 4;
  const std::size_t n = pairs_.size();
  // Bullet's algorithms may reallocate the array.
  const auto visit_pair = [&](std::size_t i) {
    if (i >= pairs_of(cache).size()) return;
    (*dispatcher.getNearCallback())(cache.getOverlappingPairArrayPtr()[i], dispatcher, info);
  };
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    if (k + kAhead < chosen.size()) prefetch_pair(chosen[k + kAhead]);
    visit_pair(chosen[k]);
  }
  for (std::size_t i = n; i < pairs_of(cache).size(); ++i) visit_pair(i);
}

void BatchEngine::add(const CommitCounts& counts) {
  stats_.sphere_pairs += counts.sphere_pairs;
  stats_.touching += counts.touching;
  stats_.written += counts.written;
  stats_.sphere_boxes += counts.sphere_boxes;
  stats_.sphere_planes += counts.sphere_planes;
  stats_.convex_pairs += counts.convex_pairs;
  stats_.sphere_concaves += counts.sphere_concaves;
  stats_.concave_pairs += counts.concave_pairs;
  stats_.compound_pairs += counts.compound_pairs;
  for (std::size_t i = 1; i < kConcaveFallbackCount; ++i) {
    stats_.concave_fallbacks[i] += counts.concave_fallbacks[i];
  }
}

void BatchEngine::check(btCollisionDispatcher& dispatcher, const btDispatcherInfo& info,
                        std::size_t i, bool current) {
  ++stats_.verified;
  const btPersistentManifold* manifold = batch_.manifold(i);
  const PairContact* contact = first_contact(touching_, i);
  const bool touches = contact != touching_.data() + touching_.size() && contact->pair == i;
  const auto difference =
      check_pair(&dispatcher, info, *batch_.body_a(i), *batch_.body_b(i),
                 touches ? contact : nullptr, *manifold, current ? manifold : nullptr);
  note(difference);
}

/// Checks pairs of a sphere and a box or plane after an unordered commit. Bullet's algorithm calls
/// no global callback here; with such a callback, the order would be observable.
void BatchEngine::check_convex(btCollisionDispatcher& dispatcher, const btDispatcherInfo& info) {
  convex_check_.for_each(
      unordered_commit_.remaining(), [&](std::size_t i, const btPersistentManifold& before) {
        const btCollisionObject *a = batch_.body_a(i), *b = batch_.body_b(i);
        if (!dispatcher.needsCollision(a, b)) return;
        ++stats_.verified;
        note(check_update(*pairs_[i].m_algorithm, info, *a, *b, before, batch_.manifold(i)));
      });
}

void BatchEngine::note(const std::optional<FieldDifference>& difference) {
  if (!difference) return;
  if (stats_.mismatches++ == 0) stats_.first_mismatch = to_text(*difference);
}

void BatchEngine::reset_stats() {
  std::string device_failure = std::move(stats_.device_failure);
  std::string warning = std::move(stats_.warning);
  stats_ = {};
  stats_.warning = std::move(warning);
  stats_.device_failure = std::move(device_failure);
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
