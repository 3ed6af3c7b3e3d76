/// The engine that libjfpx-bullet-preload loads: batches for dispatchers that know nothing of jfpx.
#include "src/bullet/preload_engine.hpp"

#include "src/bullet/batch_engine.hpp"
#include "src/bullet/preload_options.hpp"
#include "src/bullet/preload_solver.hpp"

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>

#include <cstdio>
#include <mutex>
#include <string>
#include <string_view>
#include <typeinfo>
#include <vector>

namespace jfpx::inline JFPX_ABI::bullet {
namespace {

/// From JFPX_PRELOAD_BACKEND, _MINIMUM_BATCH, _THREADS and _VERIFY.
DispatcherOptions options_from_environment() {
  DispatcherOptions options;
  const std::string_view backend = preload_setting("JFPX_PRELOAD_BACKEND");
  if (backend == "x86") options.collider.backend = Backend::x86;
  if (backend == "cuda") options.collider.backend = Backend::cuda;
  if (const auto pairs = preload_number("JFPX_PRELOAD_MINIMUM_BATCH"))
    options.minimum_batch = *pairs;
  options.collider.threads = preload_threads();
  const std::string_view verify = preload_setting("JFPX_PRELOAD_VERIFY");
  options.verify = !verify.empty() && verify != "0";
  return options;
}

/// One engine for each dispatch that runs at the same time: dispatchers may live in several
/// threads, and nothing says when one of them is gone.
class EnginePool {
 public:
  /// Never destroyed: threads may dispatch, and the summary is written, while the process ends.
  static EnginePool& instance() {
    static EnginePool& pool = *new EnginePool;
    return pool;
  }

  /// Null if no collider can be had.
  BatchEngine* take() {
    const std::lock_guard lock(mutex_);
    if (idle_.empty()) return make();
    BatchEngine* engine = idle_.back();
    idle_.pop_back();
    return engine;
  }
  void give_back(BatchEngine* engine) {
    const std::lock_guard lock(mutex_);
    idle_.push_back(engine);
  }
  /// Of the engines that are not at work.
  DispatchStats stats(std::string_view* backend) {
    const std::lock_guard lock(mutex_);
    DispatchStats sum;
    for (const BatchEngine* engine : idle_) {
      const DispatchStats& stats = engine->stats();
      sum.dispatches += stats.dispatches;
      sum.batches += stats.batches;
      sum.pairs += stats.pairs;
      sum.sphere_pairs += stats.sphere_pairs;
      sum.touching += stats.touching;
      sum.written += stats.written;
      sum.sphere_boxes += stats.sphere_boxes;
      sum.sphere_planes += stats.sphere_planes;
      sum.verified += stats.verified;
      if (sum.mismatches == 0) sum.first_mismatch = stats.first_mismatch;
      sum.mismatches += stats.mismatches;
      for (std::size_t i = 0; i < kFallbackCount; ++i) sum.fallbacks[i] += stats.fallbacks[i];
      if (!stats.failure.empty()) sum.failure = stats.failure;
      sum.prepare_ms += stats.prepare_ms;
      sum.commit_ms += stats.commit_ms;
      if (stats.batches > 0) *backend = to_string(engine->backend());
    }
    if (!failure_.empty()) sum.failure = failure_;
    return sum;
  }

 private:
  BatchEngine* make() {
    if (!failure_.empty()) return nullptr;
    try {
      const DispatcherOptions options = options_from_environment();
      idle_.reserve(++made_);
      return new BatchEngine(make_sphere_collider(options.collider), options);
    } catch (const std::exception& error) {
      failure_ = error.what();
      return nullptr;
    }
  }

  std::mutex mutex_;
  std::vector<BatchEngine*> idle_;
  std::size_t made_ = 0;  ///< room for all in idle_, so that giving back can't fail
  std::string failure_;
};

/// An engine for the time of a dispatch, also when a callback throws.
class Lease {
 public:
  Lease() : engine_(EnginePool::instance().take()) {}
  ~Lease() {
    if (engine_ != nullptr) EnginePool::instance().give_back(engine_);
  }
  Lease(const Lease&) = delete;
  Lease& operator=(const Lease&) = delete;
  BatchEngine* get() const { return engine_; }

 private:
  BatchEngine* engine_;
};

}  // namespace

extern "C" {

JFPX_API bool jfpx_preload_try_dispatch(void* dispatcher, void* pair_cache, const void* info,
                                        void* argument) {
  const Lease engine;
  if (engine.get() == nullptr) return false;
  btCollisionDispatcher& own = *static_cast<btCollisionDispatcher*>(dispatcher);
  const bool subclass = typeid(own) != typeid(btCollisionDispatcher);
  const DispatcherTraits traits{.may_override_filter = subclass, .tells_releases = false};
  return engine.get()->dispatch(own, traits, *static_cast<btOverlappingPairCache*>(pair_cache),
                                *static_cast<const btDispatcherInfo*>(info),
                                static_cast<btDispatcher*>(argument));
}

JFPX_API void jfpx_preload_print_summary(const char* prefix) {
  using Count = unsigned long long;
  std::string_view backend = "none";
  const DispatchStats stats = EnginePool::instance().stats(&backend);
  std::fprintf(stderr, "%sBullet in %s: %llu dispatches, %llu batches (%.*s)\n", prefix,
               sizeof(Real) == 4 ? "float" : "double", Count{stats.dispatches},
               Count{stats.batches}, static_cast<int>(backend.size()), backend.data());
  std::fprintf(stderr,
               "%sin batches: %llu pairs, %llu of spheres, %llu touching, %llu written, "
               "%.1f ms of collider, %.1f ms of commit\n",
               prefix, Count{stats.pairs}, Count{stats.sphere_pairs}, Count{stats.touching},
               Count{stats.written}, stats.prepare_ms, stats.commit_ms);
  for (std::size_t i = 0; i < kFallbackCount; ++i) {
    if (stats.fallbacks[i] == 0) continue;
    const std::string_view reason = to_string(static_cast<Fallback>(i));
    std::fprintf(stderr, "%sleft to Bullet: %llu (%.*s)\n", prefix, Count{stats.fallbacks[i]},
                 static_cast<int>(reason.size()), reason.data());
  }
  if (stats.verified > 0) {
    std::fprintf(stderr, "%sverified: %llu sphere pairs, %llu mismatches %s\n", prefix,
                 Count{stats.verified}, Count{stats.mismatches}, stats.first_mismatch.c_str());
  }
  if (!stats.failure.empty()) {
    std::fprintf(stderr, "%sthe collider failed: %s\n", prefix, stats.failure.c_str());
  }
  print_solver_summary(prefix);
}

}  // extern "C"

}  // namespace jfpx::inline JFPX_ABI::bullet
