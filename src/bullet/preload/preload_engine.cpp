/// The engine that libjfpx-bullet-preload loads: batches for the dispatchers of unmodified
/// programs.
#include "src/bullet/preload/preload_engine.hpp"

#include "src/bullet/dispatch/batch_engine.hpp"
#include "src/bullet/exact_class.hpp"
#include "src/bullet/preload/object_pool.hpp"
#include "src/bullet/preload/preload_options.hpp"
#include "src/bullet/preload/preload_solver.hpp"

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>

#include <cstdio>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

std::unique_ptr<BatchEngine> make_engine() {
  const PreloadOptions& from = preload_options();
  DispatcherOptions options;
  options.collider.backend = from.backend;
  options.collider.threads = from.threads;
  options.collider.costs = calibrated_costs().costs;
  if (from.minimum_batch) options.minimum_batch = *from.minimum_batch;
  options.verify = from.verify;
  return std::make_unique<BatchEngine>(make_sphere_collider(options.collider), options);
}

/// Never destroyed, because threads may dispatch, and the summary is written, during process exit.
ObjectPool<BatchEngine>& pool() {
  static auto& made = *new ObjectPool<BatchEngine>(make_engine);
  return made;
}

/// @param backend is set to the backend of the batches, if there are any
DispatchStats sum_of_stats(std::string_view* backend) {
  DispatchStats sum;
  pool().for_each_idle([&](const BatchEngine& engine) {
    const DispatchStats& stats = engine.stats();
    sum.dispatches += stats.dispatches;
    sum.batches += stats.batches;
    sum.pairs += stats.pairs;
    sum.sphere_pairs += stats.sphere_pairs;
    sum.touching += stats.touching;
    sum.written += stats.written;
    sum.sphere_boxes += stats.sphere_boxes;
    sum.sphere_planes += stats.sphere_planes;
    sum.convex_pairs += stats.convex_pairs;
    sum.sphere_concaves += stats.sphere_concaves;
    sum.concave_pairs += stats.concave_pairs;
    sum.compound_pairs += stats.compound_pairs;
    for (std::size_t i = 0; i < kConcaveFallbackCount; ++i) {
      sum.concave_fallbacks[i] += stats.concave_fallbacks[i];
    }
    sum.verified += stats.verified;
    if (sum.mismatches == 0) sum.first_mismatch = stats.first_mismatch;
    sum.mismatches += stats.mismatches;
    for (std::size_t i = 0; i < kFallbackCount; ++i) sum.fallbacks[i] += stats.fallbacks[i];
    for (std::size_t i = 0; i < kOrderReasonCount; ++i) sum.ordered[i] += stats.ordered[i];
    sum.to_device += stats.to_device;
    sum.from_device += stats.from_device;
    if (!stats.failure.empty()) sum.failure = stats.failure;
    if (!stats.device_failure.empty()) sum.device_failure = stats.device_failure;
    sum.prepare_ms += stats.prepare_ms;
    sum.commit_ms += stats.commit_ms;
    if (stats.batches > 0) *backend = to_string(engine.backend());
  });
  if (std::string failure = pool().failure(); !failure.empty()) sum.failure = std::move(failure);
  return sum;
}

}  // namespace

extern "C" {

JFPX_SYMBOL_EXPORT bool jfpx_preload_try_dispatch(void* dispatcher, void* pair_cache,
                                                  const void* info, void* argument) {
  const ObjectPool<BatchEngine>::Handle engine(pool());
  if (engine.get() == nullptr) return false;
  btCollisionDispatcher& own = *static_cast<btCollisionDispatcher*>(dispatcher);
  const bool subclass = !is_exactly<btCollisionDispatcher>(own);
  const DispatcherTraits traits{.may_override_filter = subclass, .reports_releases = false};
  return engine.get()->dispatch(own, traits, *static_cast<btOverlappingPairCache*>(pair_cache),
                                *static_cast<const btDispatcherInfo*>(info),
                                static_cast<btDispatcher*>(argument));
}

JFPX_SYMBOL_EXPORT void jfpx_preload_print_summary(std::FILE* to, const char* prefix) {
  using Count = unsigned long long;
  std::string_view backend = "none";
  const DispatchStats stats = sum_of_stats(&backend);
  std::fprintf(to, "%sBullet in %s: %llu dispatches, %llu batches (%.*s)\n", prefix,
               sizeof(Real) == 4 ? "float" : "double", Count{stats.dispatches},
               Count{stats.batches}, static_cast<int>(backend.size()), backend.data());
  std::fprintf(to,
               "%sbatches: %llu pairs, %llu sphere pairs, %llu touching, %llu written, "
               "%.1f ms prepare, %.1f ms commit\n",
               prefix, Count{stats.pairs}, Count{stats.sphere_pairs}, Count{stats.touching},
               Count{stats.written}, stats.prepare_ms, stats.commit_ms);
  for (std::size_t i = 0; i < kFallbackCount; ++i) {
    if (stats.fallbacks[i] == 0) continue;
    const std::string_view reason = to_string(static_cast<Fallback>(i));
    std::fprintf(to, "%sleft to Bullet: %llu (%.*s)\n", prefix, Count{stats.fallbacks[i]},
                 static_cast<int>(reason.size()), reason.data());
  }
  for (std::size_t i = 1; i < kOrderReasonCount; ++i) {
    if (stats.ordered[i] == 0) continue;
    const std::string_view reason = to_string(static_cast<OrderReason>(i));
    std::fprintf(to, "%sbatches in Bullet's order: %llu (%.*s)\n", prefix, Count{stats.ordered[i]},
                 static_cast<int>(reason.size()), reason.data());
  }
  for (std::size_t i = 1; i < kConcaveFallbackCount; ++i) {
    if (stats.concave_fallbacks[i] == 0) continue;
    const std::string_view reason = to_string(static_cast<ConcaveFallback>(i));
    std::fprintf(to, "%spairs with concave shapes left to Bullet: %llu (%.*s)\n", prefix,
                 Count{stats.concave_fallbacks[i]}, static_cast<int>(reason.size()), reason.data());
  }
  if (stats.verified > 0) {
    std::fprintf(to, "%sverified: %llu pairs, %llu mismatches%s%s\n", prefix, Count{stats.verified},
                 Count{stats.mismatches},
                 stats.first_mismatch.empty() ? "" : "; first: ", stats.first_mismatch.c_str());
  }
  for (const std::string& failure : {stats.failure, stats.device_failure}) {
    if (!failure.empty()) std::fprintf(to, "%sfailed: %s\n", prefix, failure.c_str());
  }
  print_solver_summary(to, prefix);
}

}  // extern "C"

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
