/// Solving of groups and updates of AABBs for the worlds of unmodified programs.
#include "src/bullet/preload/preload_solver.hpp"

#include <jfpx/bullet/constraint_solver.hpp>

#include "src/bullet/exact_class.hpp"
#include "src/bullet/preload/object_pool.hpp"
#include "src/bullet/preload/preload_options.hpp"
#include "src/bullet/world/aabb_update.hpp"

#include <atomic>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// The state of Bullet's solver that persists between groups, and its arrays.
struct SolverState : btSequentialImpulseConstraintSolver {
  /// The memory of the arrays is Bullet's, whose allocator the program may replace or reset when
  /// its solver does not exist. It must therefore belong to the program's solver between groups.
  /// Not inlined, because its copies of arrays would be on the stack of the solver.
  [[gnu::noinline]] static void swap_arrays(btSequentialImpulseConstraintSolver* a,
                                            btSequentialImpulseConstraintSolver* b) {
    const auto swap = [&](auto member) { swap_bytes(&(a->*member), &(b->*member)); };
    swap(&SolverState::m_tmpSolverBodyPool);
    swap(&SolverState::m_tmpSolverContactConstraintPool);
    swap(&SolverState::m_tmpSolverNonContactConstraintPool);
    swap(&SolverState::m_tmpSolverContactFrictionConstraintPool);
    swap(&SolverState::m_tmpSolverContactRollingFrictionConstraintPool);
    swap(&SolverState::m_orderTmpConstraintPool);
    swap(&SolverState::m_orderNonContactConstraintPool);
    swap(&SolverState::m_orderFrictionConstraintPool);
    swap(&SolverState::m_tmpConstraintSizesPool);
    swap(&SolverState::m_kinematicBodyUniqueIdToSolverBodyTable);
  }
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

 private:
  /// btAlignedObjectArray has no function that exchanges the memory of two arrays.
  template <class Item>
  static void swap_bytes(btAlignedObjectArray<Item>* a, btAlignedObjectArray<Item>* b) {
    std::byte kept[sizeof *a];
    std::memcpy(kept, static_cast<const void*>(a), sizeof kept);
    std::memcpy(static_cast<void*>(a), static_cast<const void*>(b), sizeof kept);
    std::memcpy(static_cast<void*>(b), kept, sizeof kept);
  }
};

/// Is a class of its own, because operator new of ConstraintSolver calls Bullet's allocator.
struct PooledSolver {
  ConstraintSolver solver;
};

std::unique_ptr<PooledSolver> make_solver() {
  const PreloadOptions& from = preload_options();
  ConstraintSolverOptions options;
  options.backend = from.backend;
  options.threads = from.threads;
  if (from.minimum_batch) options.minimum_batch = *from.minimum_batch;
  return std::unique_ptr<PooledSolver>(new PooledSolver{ConstraintSolver(options)});
}

/// Never destroyed, like the counters below, because threads may solve, and the summary is written,
/// during process exit.
ObjectPool<PooledSolver>& pool() {
  static auto& made = *new ObjectPool<PooledSolver>(make_solver);
  return made;
}

/// For the AABBs of one world at a time.
struct BoxUpdater {
  ThreadPool threads{preload_options().threads};
  AabbUpdate update;
};
ObjectPool<BoxUpdater>& box_updaters() {
  static auto& made = *new ObjectPool<BoxUpdater>([] { return std::make_unique<BoxUpdater>(); });
  return made;
}

std::atomic<std::uint64_t> g_small{0}, g_aabb_updates{0};

std::size_t minimum_batch() {
  return preload_options().minimum_batch.value_or(ConstraintSolverOptions{}.minimum_batch);
}

ConstraintSolverStats sum_of_stats() {
  ConstraintSolverStats sum;
  pool().for_each_idle([&](const PooledSolver& pooled) {
    const ConstraintSolverStats& stats = pooled.solver.stats();
    sum.groups += stats.groups;
    sum.on_device += stats.on_device;
    sum.contacts += stats.contacts;
    sum.joints += stats.joints;
    sum.sweeps += stats.sweeps;
    for (std::size_t i = 0; i < kSolverFallbacks; ++i) sum.fallbacks[i] += stats.fallbacks[i];
    if (!stats.device_failure.empty()) sum.device_failure = stats.device_failure;
  });
  sum.fallbacks[static_cast<std::size_t>(SolverFallback::small)] += g_small;
  return sum;
}

/// Lends the arrays and the state of the program's solver to jfpx's solver for its lifetime, even
/// after an exception.
class SolverStateTransfer {
 public:
  SolverStateTransfer(btSequentialImpulseConstraintSolver* original, ConstraintSolver* solver)
      : original_(original), solver_(solver) {
    SolverState::swap_arrays(original_, solver_);
    SolverState::copy(*original_, solver_);
  }
  ~SolverStateTransfer() {
    SolverState::copy(*solver_, original_);
    SolverState::swap_arrays(original_, solver_);
  }
  SolverStateTransfer(const SolverStateTransfer&) = delete;
  SolverStateTransfer& operator=(const SolverStateTransfer&) = delete;

 private:
  btSequentialImpulseConstraintSolver* original_;
  ConstraintSolver* solver_;
};

}  // namespace

void print_solver_summary(std::FILE* to, const char* prefix) {
  using Count = unsigned long long;
  const ConstraintSolverStats stats = sum_of_stats();
  if (g_aabb_updates > 0) {
    std::fprintf(to, "%sworld: %llu AABB updates\n", prefix, Count{g_aabb_updates});
  }
  if (stats.groups > 0) {
    std::fprintf(to, "%ssolver: %llu groups, %llu contacts, %llu joints\n", prefix,
                 Count{stats.groups}, Count{stats.contacts}, Count{stats.joints});
  }
  if (stats.on_device > 0) {
    std::fprintf(to, "%ssolver: %llu groups on a GPU\n", prefix, Count{stats.on_device});
  }
  for (const std::string& failure : {pool().failure(), stats.device_failure}) {
    if (!failure.empty()) std::fprintf(to, "%ssolver: failed: %s\n", prefix, failure.c_str());
  }
  for (std::size_t i = 0; i < kSolverFallbacks; ++i) {
    if (stats.fallbacks[i] == 0) continue;
    const std::string_view reason = to_string(static_cast<SolverFallback>(i));
    std::fprintf(to, "%sgroups left to Bullet: %llu (%.*s)\n", prefix, Count{stats.fallbacks[i]},
                 static_cast<int>(reason.size()), reason.data());
  }
}

extern "C" {

/// Supports exactly Bullet's class, because a derived class may use the inherited state.
JFPX_SYMBOL_EXPORT bool jfpx_preload_try_solve(void* solver, void** bodies, int body_count,
                                               void** manifolds, int manifold_count, void** joints,
                                               int joint_count, const void* info, void* drawer,
                                               void* dispatcher) {
  auto* own = static_cast<btSequentialImpulseConstraintSolver*>(solver);
  if (!is_exactly<btSequentialImpulseConstraintSolver>(*own)) return false;
  if (static_cast<std::size_t>(manifold_count) < minimum_batch()) {
    g_small.fetch_add(1, std::memory_order_relaxed);
    return false;
  }
  const ObjectPool<PooledSolver>::Handle ours(pool());
  if (ours.get() == nullptr) return false;
  ConstraintSolver& our_solver = ours.get()->solver;
  const SolverStateTransfer transfer(own, &our_solver);
  our_solver.solveGroup(reinterpret_cast<btCollisionObject**>(bodies), body_count,
                        reinterpret_cast<btPersistentManifold**>(manifolds), manifold_count,
                        reinterpret_cast<btTypedConstraint**>(joints), joint_count,
                        *static_cast<const btContactSolverInfo*>(info),
                        static_cast<btIDebugDraw*>(drawer), static_cast<btDispatcher*>(dispatcher));
  return true;
}

/// Supports every class of world, because the function uses only the public interface.
JFPX_SYMBOL_EXPORT bool jfpx_preload_try_update_boxes(void* world) {
  const ObjectPool<BoxUpdater>::Handle ours(box_updaters());
  if (ours.get() == nullptr) return false;
  if (!ours.get()->update.run(*static_cast<btCollisionWorld*>(world), ours.get()->threads)) {
    return false;
  }
  g_aabb_updates.fetch_add(1, std::memory_order_relaxed);
  return true;
}

}  // extern "C"

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
