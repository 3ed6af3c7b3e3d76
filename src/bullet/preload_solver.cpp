/// Groups and boxes of worlds that know nothing of jfpx; see the header.
#include "src/bullet/preload_solver.hpp"

#include <jfpx/bullet/constraint_solver.hpp>

#include "src/bullet/box_update.hpp"
#include "src/bullet/preload_options.hpp"

#include <atomic>
#include <cstdio>
#include <mutex>
#include <string_view>
#include <typeinfo>
#include <vector>

namespace jfpx::inline JFPX_ABI::bullet {
namespace {

/// All that a solver of Bullet's keeps from one group to the next.
struct SolverState : btSequentialImpulseConstraintSolver {
  static void copy(const btSequentialImpulseConstraintSolver& from,
                   btSequentialImpulseConstraintSolver* to) {
    const auto field = [&](auto member) { to->*member = from.*member; };
    field(&SolverState::m_resolveSingleConstraintRowGeneric);
    field(&SolverState::m_resolveSingleConstraintRowLowerLimit);
    field(&SolverState::m_resolveSplitPenetrationImpulse);
    field(&SolverState::m_cachedSolverMode);
    field(&SolverState::m_leastSquaresResidual);
    field(&SolverState::m_btSeed2);
    field(&SolverState::m_analyticsData);
  }
};

ConstraintSolverOptions options_from_environment() {
  ConstraintSolverOptions options;
  // Else whoever is faster, which is never an error: there is nobody to tell.
  if (preload_setting("JFPX_PRELOAD_BACKEND") == "x86") options.backend = Backend::x86;
  options.threads = preload_threads();
  if (const auto least = preload_number("JFPX_PRELOAD_MINIMUM_BATCH")) {
    options.minimum_batch = *least;
  }
  return options;
}

/// One solver for each group that is solved at the same time: they take the place of the program's
/// for a group, because nothing says when one of those is gone.
class SolverPool {
 public:
  /// Never destroyed: threads may solve, and the summary is written, while the process ends.
  static SolverPool& instance() {
    static SolverPool& pool = *new SolverPool;
    return pool;
  }
  ConstraintSolver* take() {
    const std::lock_guard lock(mutex_);
    if (idle_.empty()) {
      idle_.reserve(++made_);
      return new ConstraintSolver(options_);
    }
    ConstraintSolver* solver = idle_.back();
    idle_.pop_back();
    return solver;
  }
  void give_back(ConstraintSolver* solver) {
    const std::lock_guard lock(mutex_);
    idle_.push_back(solver);
  }
  std::size_t minimum_batch() const { return options_.minimum_batch; }

  /// Of the solvers that are not at work.
  ConstraintSolverStats stats() {
    const std::lock_guard lock(mutex_);
    ConstraintSolverStats sum;
    for (const ConstraintSolver* solver : idle_) {
      const ConstraintSolverStats& stats = solver->stats();
      sum.groups += stats.groups;
      sum.contacts += stats.contacts;
      sum.joints += stats.joints;
      for (std::size_t i = 0; i < kSolverFallbacks; ++i) sum.fallbacks[i] += stats.fallbacks[i];
    }
    sum.fallbacks[static_cast<std::size_t>(SolverFallback::small)] += small;
    return sum;
  }

  std::atomic<std::uint64_t> small{0}, boxes{0};

 private:
  const ConstraintSolverOptions options_ = options_from_environment();
  std::mutex mutex_;
  std::vector<ConstraintSolver*> idle_;
  std::size_t made_ = 0;  ///< room for all in idle_, so that giving back can't fail
};

/// A solver for the time of a group, also when something in it throws.
class StandIn {
 public:
  explicit StandIn(btSequentialImpulseConstraintSolver* original)
      : original_(original), solver_(SolverPool::instance().take()) {
    SolverState::copy(*original_, solver_);
  }
  ~StandIn() {
    SolverState::copy(*solver_, original_);
    SolverPool::instance().give_back(solver_);
  }
  StandIn(const StandIn&) = delete;
  StandIn& operator=(const StandIn&) = delete;
  ConstraintSolver* operator->() const { return solver_; }

 private:
  btSequentialImpulseConstraintSolver* original_;
  ConstraintSolver* solver_;
};

}  // namespace

void print_solver_summary(const char* prefix) {
  using Count = unsigned long long;
  SolverPool& pool = SolverPool::instance();
  const ConstraintSolverStats stats = pool.stats();
  if (pool.boxes > 0) {
    std::fprintf(stderr, "%sworld: %llu updates of all boxes\n", prefix, Count{pool.boxes});
  }
  if (stats.groups > 0) {
    std::fprintf(stderr, "%ssolver: %llu groups, %llu contacts, %llu joints\n", prefix,
                 Count{stats.groups}, Count{stats.contacts}, Count{stats.joints});
  }
  for (std::size_t i = 0; i < kSolverFallbacks; ++i) {
    if (stats.fallbacks[i] == 0) continue;
    const std::string_view reason = to_string(static_cast<SolverFallback>(i));
    std::fprintf(stderr, "%sgroups left to Bullet: %llu (%.*s)\n", prefix,
                 Count{stats.fallbacks[i]}, static_cast<int>(reason.size()), reason.data());
  }
}

extern "C" {

/// Serves Bullet's own class only: what others do with what they inherit is not known.
JFPX_API bool jfpx_preload_try_solve(void* solver, void** bodies, int body_count, void** manifolds,
                                     int manifold_count, void** joints, int joint_count,
                                     const void* info, void* drawer, void* dispatcher) {
  auto* own = static_cast<btSequentialImpulseConstraintSolver*>(solver);
  if (typeid(*own) != typeid(btSequentialImpulseConstraintSolver)) return false;
  SolverPool& pool = SolverPool::instance();
  if (static_cast<std::size_t>(manifold_count) < pool.minimum_batch()) {
    pool.small.fetch_add(1, std::memory_order_relaxed);
    return false;
  }
  const StandIn stand_in(own);
  stand_in->solveGroup(reinterpret_cast<btCollisionObject**>(bodies), body_count,
                       reinterpret_cast<btPersistentManifold**>(manifolds), manifold_count,
                       reinterpret_cast<btTypedConstraint**>(joints), joint_count,
                       *static_cast<const btContactSolverInfo*>(info),
                       static_cast<btIDebugDraw*>(drawer), static_cast<btDispatcher*>(dispatcher));
  return true;
}

/// Serves every world: the function is all that Bullet's does, through what is public of it.
JFPX_API bool jfpx_preload_try_update_boxes(void* world) {
  thread_local BoxUpdate update;
  if (!update.run(*static_cast<btCollisionWorld*>(world))) return false;
  SolverPool::instance().boxes.fetch_add(1, std::memory_order_relaxed);
  return true;
}

}  // extern "C"

}  // namespace jfpx::inline JFPX_ABI::bullet
