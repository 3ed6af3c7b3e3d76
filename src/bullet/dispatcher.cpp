/// One dispatch: a read-only pre-pass over all pairs, the collider, then one walk in the order of
/// the pair cache that does for each pair what Bullet would have done.
#include <jfpx/bullet/dispatcher.hpp>
#include <jfpx/error.hpp>

#include "src/bullet/contact_point.hpp"
#include "src/bullet/pair_check.hpp"
#include "src/bullet/sphere_batch.hpp"

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>
#include <BulletCollision/CollisionDispatch/btCollisionConfiguration.h>
#include <LinearMath/btQuickprof.h>

#include <chrono>
#include <exception>
#include <type_traits>
#include <typeinfo>

namespace jfpx::inline JFPX_ABI::bullet {

static_assert(std::is_same_v<btScalar, Real>, "jfpx and Bullet must have the same precision");

namespace {

using Clock = std::chrono::steady_clock;

double milliseconds(Clock::time_point begin, Clock::time_point end) {
  return std::chrono::duration<double, std::milli>(end - begin).count();
}

std::span<const btBroadphasePair> pairs_of(btOverlappingPairCache& cache) {
  const int n = cache.getNumOverlappingPairs();
  // Bullet asserts when an empty cache is asked for its array.
  if (n <= 0) return {};
  return {cache.getOverlappingPairArrayPtr(), static_cast<std::size_t>(n)};
}

/// Sets a flag for the time of a dispatch, also when a callback throws.
class Running {
 public:
  explicit Running(bool* flag) : flag_(flag) { *flag_ = true; }
  ~Running() { *flag_ = false; }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

 private:
  bool* flag_;
};

/// The ordered walk. The pair cache itself drives it, so the order is Bullet's for every kind of
/// cache, with and without m_deterministicOverlappingPairs.
class CommitWalk final : public btOverlapCallback {
 public:
  CommitWalk(CollisionDispatcher* dispatcher, const btDispatcherInfo& info,
             std::span<const btBroadphasePair> pairs, std::span<const PairResult> results,
             const SphereBatch& batch, DispatchStats* stats, bool verify)
      : dispatcher_(dispatcher),
        info_(info),
        pairs_(pairs),
        results_(results),
        batch_(batch),
        stats_(stats),
        verify_(verify) {}

  bool processOverlap(btBroadphasePair& pair) override {
    const std::size_t i = (reinterpret_cast<std::uintptr_t>(&pair) -
                           reinterpret_cast<std::uintptr_t>(pairs_.data())) /
                          sizeof(btBroadphasePair);
    if (i >= pairs_.size()) {  // added by a callback during this walk
      visit_stock(pair);
      return false;
    }
    prefetch(i + kAhead);
    const bool current = visit(i, pair);
    if (verify_ && batch_.manifold(i) != nullptr) check(i, current);
    return false;
  }

 private:
  /// Commits in flight: enough to hide memory, few enough to stay in the cache.
  static constexpr std::size_t kAhead = 12;

  void prefetch(std::size_t i) const {
    if (i < pairs_.size() && batch_.action(i) == Action::commit) batch_.prefetch_commit(i);
  }

  void visit_stock(btBroadphasePair& pair) const {
    (*dispatcher_->getNearCallback())(pair, *dispatcher_, info_);
  }

  /// True if the manifold is now what the result says; false if the filter kept it as it was.
  bool visit(std::size_t i, btBroadphasePair& pair) const {
    switch (batch_.action(i)) {
      case Action::stock:
        visit_stock(pair);
        return true;
      case Action::skip:
        return true;
      case Action::ask:
        dispatcher_->needsCollision(batch_.body_a(i), batch_.body_b(i));
        return true;
      case Action::commit:
        break;
    }
    const btCollisionObject* a = batch_.body_a(i);
    const btCollisionObject* b = batch_.body_b(i);
    if (!can_write_flat(*batch_.manifold(i), *a, *b)) {
      visit_stock(pair);
      return false;  // the near callback asks the filter itself, and does not say what it heard
    }
    if (!dispatcher_->needsCollision(a, b)) return false;
    ++stats_->written;
    write_contact(batch_.manifold(i), results_[i], *a, *b,
                  batch_.spheres()[batch_.sphere_pairs()[i].b].radius);
    return true;
  }

  void check(std::size_t i, bool current) const {
    ++stats_->verified;
    const btPersistentManifold* manifold = batch_.manifold(i);
    const auto difference = check_pair(dispatcher_, info_, *batch_.body_a(i), *batch_.body_b(i),
                                       results_[i], *manifold, current ? manifold : nullptr);
    if (!difference) return;
    if (stats_->mismatches++ == 0) stats_->first_mismatch = to_text(*difference);
  }

  CollisionDispatcher* dispatcher_;
  const btDispatcherInfo& info_;
  std::span<const btBroadphasePair> pairs_;
  std::span<const PairResult> results_;
  const SphereBatch& batch_;
  DispatchStats* stats_;
  bool verify_;
};

}  // namespace

struct CollisionDispatcher::Impl {
  std::unique_ptr<SphereCollider> collider;
  std::size_t minimum_batch;
  bool verify;
  btCollisionAlgorithmCreateFunc* stock_create_function;
  bool running = false;
  SphereBatch batch;
  DispatchStats stats;

  /// Everything before the walk; empty results and `*fallback` set if there is nothing to do or
  /// the collider failed.
  std::span<const PairResult> prepare(std::span<const btBroadphasePair> pairs, bool ask_all,
                                      Fallback* fallback) {
    try {
      if (!batch.gather(pairs)) {
        *fallback = Fallback::no_spheres;
        return {};
      }
      const std::span<const PairResult> results =
          collider->test_pairs(batch.spheres(), batch.sphere_pairs());
      batch.plan(pairs, results, ask_all);
      return results;
    } catch (const std::exception& error) {
      stats.failure = error.what();
      if (stats.failure.empty()) stats.failure = "unknown";
      *fallback = Fallback::collider_failed;
      return {};
    }
  }
};

CollisionDispatcher::CollisionDispatcher(btCollisionConfiguration* configuration,
                                         const DispatcherOptions& options)
    : CollisionDispatcher(configuration, make_sphere_collider(options.collider), options) {}

CollisionDispatcher::CollisionDispatcher(btCollisionConfiguration* configuration,
                                         std::unique_ptr<SphereCollider> collider,
                                         const DispatcherOptions& options)
    : btCollisionDispatcher(configuration), impl_(std::make_unique<Impl>()) {
  if (collider == nullptr) throw InvalidArgument("collider is null; it must be a SphereCollider");
  impl_->collider = std::move(collider);
  impl_->minimum_batch = options.minimum_batch;
  impl_->verify = options.verify;
  impl_->stock_create_function =
      m_doubleDispatchContactPoints[SPHERE_SHAPE_PROXYTYPE][SPHERE_SHAPE_PROXYTYPE];
}

CollisionDispatcher::~CollisionDispatcher() = default;

void CollisionDispatcher::dispatchAllCollisionPairs(btOverlappingPairCache* pair_cache,
                                                    const btDispatcherInfo& dispatch_info,
                                                    btDispatcher* dispatcher) {
  Impl& impl = *impl_;
  ++impl.stats.dispatches;
  const std::span<const btBroadphasePair> pairs = pairs_of(*pair_cache);
  const btCollisionAlgorithmCreateFunc* create_function =
      m_doubleDispatchContactPoints[SPHERE_SHAPE_PROXYTYPE][SPHERE_SHAPE_PROXYTYPE];

  Fallback fallback = Fallback::none;
  if (impl.running) {
    fallback = Fallback::nested;
  } else if (!impl.stats.failure.empty()) {
    fallback = Fallback::collider_failed;
  } else if (pairs.empty() || pairs.size() < impl.minimum_batch) {
    fallback = Fallback::small_batch;
  } else if (getNearCallback() != btNearCallback(defaultNearCallback)) {
    fallback = Fallback::near_callback;
  } else if (create_function != impl.stock_create_function) {
    fallback = Fallback::create_function;
  } else if (dispatch_info.m_dispatchFunc != btDispatcherInfo::DISPATCH_DISCRETE) {
    fallback = Fallback::continuous;
  }

  const auto start = fallback == Fallback::none ? Clock::now() : Clock::time_point{};
  std::span<const PairResult> results;
  if (fallback == Fallback::none) {
    // A subclass may override needsCollision, and must then be asked about every pair.
    const bool ask_all = typeid(*this) != typeid(CollisionDispatcher);
    results = impl.prepare(pairs, ask_all, &fallback);
  }
  impl.stats.last_fallback = fallback;
  if (fallback != Fallback::none) {
    ++impl.stats.fallbacks[static_cast<std::size_t>(fallback)];
    btCollisionDispatcher::dispatchAllCollisionPairs(pair_cache, dispatch_info, dispatcher);
    return;
  }

  ++impl.stats.batches;
  impl.stats.pairs += pairs.size();
  impl.stats.sphere_pairs += impl.batch.sphere_pair_count();
  impl.stats.touching += impl.batch.touching_count();
  const auto prepared = Clock::now();
  {
    const Running running(&impl.running);
    CommitWalk walk(this, dispatch_info, pairs, results, impl.batch, &impl.stats, impl.verify);
    BT_PROFILE("processAllOverlappingPairs");
    pair_cache->processAllOverlappingPairs(&walk, dispatcher, dispatch_info);
  }
  impl.stats.prepare_ms += milliseconds(start, prepared);
  impl.stats.commit_ms += milliseconds(prepared, Clock::now());
}

std::size_t CollisionDispatcher::minimum_batch() const noexcept { return impl_->minimum_batch; }
void CollisionDispatcher::set_minimum_batch(std::size_t pairs) noexcept {
  impl_->minimum_batch = pairs;
}
bool CollisionDispatcher::verify() const noexcept { return impl_->verify; }
void CollisionDispatcher::set_verify(bool on) noexcept { impl_->verify = on; }
Backend CollisionDispatcher::backend() const noexcept { return impl_->collider->backend(); }
const DispatchStats& CollisionDispatcher::stats() const noexcept { return impl_->stats; }
void CollisionDispatcher::reset_stats() {
  std::string failure = std::move(impl_->stats.failure);
  impl_->stats = {};
  impl_->stats.failure = std::move(failure);
}

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
    case Fallback::collider_failed:
      return "collider failed";
  }
  return "unknown";
}

}  // namespace jfpx::inline JFPX_ABI::bullet
