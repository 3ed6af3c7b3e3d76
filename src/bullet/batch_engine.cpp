/// One dispatch: a read-only pre-pass over all pairs, the collider, then one walk in the order of
/// the pair cache that does for each pair what Bullet would have done.
#include "src/bullet/batch_engine.hpp"

#include <jfpx/error.hpp>

#include "src/bullet/contact_point.hpp"
#include "src/bullet/pair_check.hpp"

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>
#include <BulletCollision/CollisionDispatch/btSphereSphereCollisionAlgorithm.h>
#include <LinearMath/btQuickprof.h>

#include <chrono>
#include <exception>
#include <type_traits>
#include <typeinfo>
#include <utility>

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
  CommitWalk(btCollisionDispatcher* dispatcher, const btDispatcherInfo& info,
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

  btCollisionDispatcher* dispatcher_;
  const btDispatcherInfo& info_;
  std::span<const btBroadphasePair> pairs_;
  std::span<const PairResult> results_;
  const SphereBatch& batch_;
  DispatchStats* stats_;
  bool verify_;
};

/// Whether pairs of spheres get Bullet's own algorithm. The table of create functions is protected.
bool has_bullets_sphere_function(const btCollisionDispatcher& dispatcher) {
  struct Access : btCollisionDispatcher {
    static constexpr auto table() { return &Access::m_doubleDispatchContactPoints; }
  };
  const btCollisionAlgorithmCreateFunc* function =
      (dispatcher.*Access::table())[SPHERE_SHAPE_PROXYTYPE][SPHERE_SHAPE_PROXYTYPE];
  return function != nullptr &&
         typeid(*function) == typeid(btSphereSphereCollisionAlgorithm::CreateFunc);
}

}  // namespace

BatchEngine::BatchEngine(std::unique_ptr<SphereCollider> collider, const DispatcherOptions& options)
    : collider_(std::move(collider)),
      minimum_batch_(options.minimum_batch),
      verify_(options.verify) {
  if (collider_ == nullptr) throw InvalidArgument("collider is null; it must be a SphereCollider");
}

Fallback BatchEngine::reason_to_fall_back(const btCollisionDispatcher& dispatcher,
                                          std::size_t pairs, const btDispatcherInfo& info) const {
  if (running_) return Fallback::nested;
  if (!stats_.failure.empty()) return Fallback::collider_failed;
  if (pairs == 0 || pairs < minimum_batch_) return Fallback::small_batch;
  if (dispatcher.getNearCallback() != btNearCallback(btCollisionDispatcher::defaultNearCallback)) {
    return Fallback::near_callback;
  }
  if (!has_bullets_sphere_function(dispatcher)) return Fallback::create_function;
  if (info.m_dispatchFunc != btDispatcherInfo::DISPATCH_DISCRETE) return Fallback::continuous;
  return Fallback::none;
}

/// Everything before the walk; empty results and `*fallback` set if there is nothing to do or
/// the collider failed.
std::span<const PairResult> BatchEngine::prepare(std::span<const btBroadphasePair> pairs,
                                                 bool ask_all, Fallback* fallback) {
  try {
    if (!batch_.gather(pairs)) {
      *fallback = Fallback::no_spheres;
      return {};
    }
    const std::span<const PairResult> results =
        collider_->test_pairs(batch_.spheres(), batch_.sphere_pairs());
    if (const auto why = collider_->device_failure(); !why.empty()) stats_.device_failure = why;
    batch_.plan(pairs, results, ask_all);
    return results;
  } catch (const std::exception& error) {
    stats_.failure = error.what();
    if (stats_.failure.empty()) stats_.failure = "unknown";
    *fallback = Fallback::collider_failed;
    return {};
  }
}

bool BatchEngine::dispatch(btCollisionDispatcher& dispatcher, bool ask_all,
                           btOverlappingPairCache& cache, const btDispatcherInfo& info,
                           btDispatcher* argument) {
  ++stats_.dispatches;
  const std::span<const btBroadphasePair> pairs = pairs_of(cache);
  Fallback fallback = reason_to_fall_back(dispatcher, pairs.size(), info);
  const auto start = fallback == Fallback::none ? Clock::now() : Clock::time_point{};
  std::span<const PairResult> results;
  if (fallback == Fallback::none) results = prepare(pairs, ask_all, &fallback);
  stats_.last_fallback = fallback;
  if (fallback != Fallback::none) {
    ++stats_.fallbacks[static_cast<std::size_t>(fallback)];
    return false;
  }

  ++stats_.batches;
  stats_.pairs += pairs.size();
  stats_.sphere_pairs += batch_.sphere_pair_count();
  stats_.touching += batch_.touching_count();
  const auto prepared = Clock::now();
  {
    const Running running(&running_);
    CommitWalk walk(&dispatcher, info, pairs, results, batch_, &stats_, verify_);
    BT_PROFILE("processAllOverlappingPairs");
    cache.processAllOverlappingPairs(&walk, argument, info);
  }
  stats_.prepare_ms += milliseconds(start, prepared);
  stats_.commit_ms += milliseconds(prepared, Clock::now());
  return true;
}

void BatchEngine::reset_stats() {
  std::string failure = std::move(stats_.failure);
  std::string device_failure = std::move(stats_.device_failure);
  stats_ = {};
  stats_.failure = std::move(failure);
  stats_.device_failure = std::move(device_failure);
}

}  // namespace jfpx::inline JFPX_ABI::bullet
