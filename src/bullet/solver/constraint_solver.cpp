/// The solver's interface and the sequence of its stages; constraint_solver_impl.hpp lists the
/// files of the stages.
#include <jfpx/error.hpp>

#include "src/base/floating_point.hpp"
#include "src/bullet/solver/constraint_solver_impl.hpp"
#include "src/bullet/solver/constraint_solver_test_access.hpp"
#include "src/bullet/solver/joint_rows.hpp"
#include "src/bullet/solver/row_inputs.hpp"
#include "src/bullet/thread_safe_library.hpp"

#include <new>
#include <utility>

extern int gNumSplitImpulseRecoveries;  // a counter of Bullet's solver

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

ConstraintSolver::Impl::Impl(ConstraintSolver& owner, const ConstraintSolverOptions& options)
    : self(owner),
      own_steps(steps()),
      own_split(owner.m_resolveSplitPenetrationImpulse),
      thread_safe_library(is_thread_safe_library()),
      solver(options.threads, options.simd),
      may_choose(options.backend != Backend::cuda),
      minimum_batch(options.minimum_batch),
      batch(options) {
  device.emplace(options.backend, cuda_group_solver_maker(options.device), solver.pool().threads());
}

std::optional<SolverFallback> ConstraintSolver::Impl::solve(
    std::span<btPersistentManifold* const> manifolds) {
  // Profile zones have the names of Bullet's solver.
  const Zone zone(*this, "solveGroup");
  is_small = manifolds.size() < kSharedManifolds;
  joint_unlisted.clear();
  scan.clear_unlisted();
  rows::RowSweepReport report;
  try {
    set_up(manifolds);
    report = solve_rows();
  } catch (const OutOfMemory&) {
    return restore(SolverFallback::out_of_memory);
  } catch (const std::bad_alloc&) {
    return restore(SolverFallback::out_of_memory);
  }
  if (report.broken) return restore(SolverFallback::not_finite);
  // Atomic, because worlds in different threads share Bullet's global counter.
  std::atomic_ref(gNumSplitImpulseRecoveries)
      .fetch_add(static_cast<int>(report.split_impulses), std::memory_order_relaxed);
  record_analytics(report, static_cast<int>(manifolds.size()));
  write_back();
  device->finished(on_device ? 0 : solver.colors());
  ++stats.groups;
  if (on_device) {
    ++stats.on_device;
  } else {
    choice.note_lanes(manifolds.size(), scan.contacts().size(), solver.blocks(), solver.lanes(),
                      joints.size());
  }
  stats.contacts += scan.contacts().size();
  stats.joints += joints.size();
  stats.sweeps += static_cast<std::uint64_t>(report.iterations);
  return std::nullopt;
}

void ConstraintSolver::Impl::set_up(std::span<btPersistentManifold* const> manifolds) {
  const Zone zone(*this, "solveGroupCacheFriendlySetup");
  settings = row_settings(*info);
  set_up_bodies();
  if (!joints.empty()) set_up_joints();
  {
    const Zone search(*this, "find contacts");
    scan.run(pool(), manifolds, flags);
    set_up_unlisted_bodies(manifolds);
  }
}

rows::RowSweepReport ConstraintSolver::Impl::solve_rows() {
  on_device = false;
  if (joints.empty() && device->choose(scan, *info)) {
    const auto report = device->solve(device_group());
    stats.device_failure = device->failure();
    on_device = report.has_value();
    if (on_device) return *report;
  }
  set_up_rows();
  return sweep();
}

DeviceGroup ConstraintSolver::Impl::device_group() {
  return {.host = solver,
          .scan = scan,
          .info = *info,
          .settings = settings,
          .bodies = solver.bodies(),
          .directions = directions(),
          .factors = factors};
}

rows::RowSweepReport ConstraintSolver::Impl::sweep() {
  const Zone zone(*this, "solveGroupCacheFriendlyIterations");
  btConstraintArray& rows = self.m_tmpSolverNonContactConstraintPool;
  const auto row_count = static_cast<std::size_t>(joints.empty() ? 0 : rows.size());
  JointRows joint_rows(solver, {row_count > 0 ? &rows[0] : nullptr, row_count}, joint_ids);
  cpu::RowSweepSettings sweeps{
      .iterations = info->m_numIterations,
      .threshold = info->m_leastSquaresResidualThreshold,
      .interleave = (info->m_solverMode & SOLVER_INTERLEAVE_CONTACT_AND_FRICTION_CONSTRAINTS) != 0,
      .warm_start = warm,
      .split_impulse = settings.split};
  if (!joints.empty()) {
    sweeps.serial = &joint_rows;
    sweeps.serial_iterations = self.m_maxOverrideNumSolverIterations;
  }
  return solver.solve(sweeps, factors);
}

/// As in Bullet, a change of the mode replaces row solvers that the user has set.
void ConstraintSolver::Impl::set_mode(const btContactSolverInfo& settings_of_step) {
  if (settings_of_step.m_solverMode == self.m_cachedSolverMode) return;
  self.setupSolverFunctions((settings_of_step.m_solverMode & SOLVER_SIMD) != 0);
  self.m_cachedSolverMode = settings_of_step.m_solverMode;
}

ConstraintSolver::ConstraintSolver(const ConstraintSolverOptions& options)
    : impl_(std::make_unique<Impl>(*this, options)) {}
ConstraintSolver::~ConstraintSolver() = default;

std::unique_ptr<ConstraintSolver> ConstraintSolverTestAccess::make(
    std::unique_ptr<GroupSolver> device, const ConstraintSolverOptions& options) {
  const auto made = std::make_shared<std::unique_ptr<GroupSolver>>(std::move(device));
  return make([made] { return std::move(*made); }, GpuIslandSolver::kStartMs, options);
}

std::unique_ptr<ConstraintSolver> ConstraintSolverTestAccess::make(
    std::function<std::unique_ptr<GroupSolver>()> make, double start_ms,
    const ConstraintSolverOptions& options) {
  ConstraintSolverOptions without_gpu = options;
  without_gpu.backend = Backend::cpu;
  auto solver = std::make_unique<ConstraintSolver>(without_gpu);
  ConstraintSolver::Impl& impl = *solver->impl_;
  impl.device.emplace(options.backend, std::move(make), impl.solver.pool().threads(), start_ms);
  return solver;
}

btScalar ConstraintSolver::solveGroup(btCollisionObject** bodies, int body_count,
                                      btPersistentManifold** manifolds, int manifold_count,
                                      btTypedConstraint** constraints, int constraint_count,
                                      const btContactSolverInfo& info, btIDebugDraw* debug_drawer,
                                      btDispatcher* dispatcher) {
  impl_->set_mode(info);
  impl_->info = &info;
  impl_->bodies = {bodies, static_cast<std::size_t>(body_count)};
  impl_->joints = {constraints, static_cast<std::size_t>(constraint_count)};
  const std::span group(manifolds, static_cast<std::size_t>(manifold_count));
  std::optional<SolverFallback> reason = impl_->fallback_reason(group);
  const bool chooses = !reason && impl_->may_choose && impl_->minimum_batch > 0;
  if (chooses && impl_->choice.leaves_to_bullet(group.size())) reason = SolverFallback::measured;
  if (!reason) {
    const TrapsMasked masked;
    reason = impl_->solve(group);
  }
  btScalar result = 0;
  if (reason) {
    ++impl_->stats.fallbacks[static_cast<std::size_t>(*reason)];
    result = btSequentialImpulseConstraintSolver::solveGroup(
        bodies, body_count, manifolds, manifold_count, constraints, constraint_count, info,
        debug_drawer, dispatcher);
  }
  if (chooses) impl_->choice.finished();
  return result;
}

std::size_t ConstraintSolver::minimum_batch() const noexcept { return impl_->minimum_batch; }
void ConstraintSolver::set_minimum_batch(std::size_t manifolds) noexcept {
  impl_->minimum_batch = manifolds;
}
const ConstraintSolverStats& ConstraintSolver::stats() const noexcept { return impl_->stats; }
void ConstraintSolver::reset_stats() {
  impl_->stats = {.device_failure = std::move(impl_->stats.device_failure)};
}

std::string_view to_string(SolverFallback fallback) noexcept {
  constexpr std::string_view kTexts[kSolverFallbacks] = {"small group",
                                                         "step overridden",
                                                         "solver mode",
                                                         "row solver replaced",
                                                         "class of a constraint",
                                                         "not finite",
                                                         "out of memory",
                                                         "measured",
                                                         "body with BT_THREADSAFE",
                                                         "rounding mode"};
  const auto i = static_cast<std::size_t>(fallback);
  return i < kSolverFallbacks ? kTexts[i] : "unknown";
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
