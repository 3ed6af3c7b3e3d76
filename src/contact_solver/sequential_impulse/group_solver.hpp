/// Interface of solvers that solve whole groups of contacts on another device.
#pragma once

#include <jfpx/config.hpp>

#include "src/contact_solver/sequential_impulse/dataflow_sweep.hpp"

#include <functional>
#include <memory>
#include <span>

namespace jfpx {
inline namespace JFPX_ABI {

/// Size of a group.
struct GroupSize {
  std::size_t bodies = 0;             ///< number of bodies, including Bullet's fixed body 0
  std::size_t contacts = 0;           ///< at least 1, fewer than 2^31
  std::size_t rolling_frictions = 0;  ///< number of contacts with rolling friction rows
  bool factors = false;               ///< whether any body has a factor other than 1
};

/// Memory for the inputs of a group.
struct GroupInputs {
  Real* bodies;    ///< kBodyFields each
  Real* factors;   ///< kFactorFields each; null if all factors are 1
  Real* contacts;  ///< kInputFields each
  /// By contact: index of its kRollingRows rows, or kNoRollingFriction; null if no contact
  /// has rolling friction.
  std::uint32_t* rolling_frictions;
  Real* rolling_friction_rows;       ///< kRollingRows * kRollingFields each
  rows::ScheduledContact* schedule;  ///< see RowOrder::build()
  std::uint32_t* slot_contacts;
  std::uint32_t* contact_counts;                   ///< by body
  rows::ScheduledContact* split_impulse_schedule;  ///< see RowOrder::select()
  std::uint32_t* split_impulse_counts;
};

struct GroupSweeps {
  rows::RowSettings settings;
  std::uint32_t split_impulse_count = 0;  ///< contacts that may have a split impulse
  int iterations = 10;                    ///< at least 1, at most kMaxGroupIterations
  Real threshold = 0;            ///< sweeps end when the largest squared residual is no larger
  std::uint32_t directions = 1;  ///< number of friction directions: 1 or 2
  bool interleave = false;       ///< solve the friction of each contact directly after the contact
  bool warm_start = false;       ///< begin with the impulses of the contacts
};
inline constexpr int kMaxGroupIterations = 1024;

/// Results are valid until the next call of inputs(). One thread at a time.
class JFPX_API GroupSolver {
 public:
  virtual ~GroupSolver() = default;
  GroupSolver(const GroupSolver&) = delete;
  GroupSolver& operator=(const GroupSolver&) = delete;

  /// Returns uninitialized memory for the inputs of a group, which any threads may fill.
  /// @throws DeviceError, OutOfMemory
  virtual GroupInputs inputs(const GroupSize& size) = 0;
  /// Solves the group whose inputs have been filled. @throws DeviceError, OutOfMemory
  virtual rows::RowSweepReport solve(const GroupSweeps& sweeps) = 0;
  /// By contact.
  virtual const rows::ContactOutcome* outcomes() const = 0;
  /// By body: kOutcomeVelocities numbers each.
  virtual const Real* velocities() const = 0;

 protected:
  GroupSolver() = default;
};

using GroupSolverMaker = std::function<std::unique_ptr<GroupSolver>()>;
/// Returns a factory of solvers on the GPU with this ordinal; null in a build without CUDA.
JFPX_API GroupSolverMaker cuda_group_solver_maker(int device);

/// Results of one run over a group.
struct GroupResults {
  const double* residuals;                ///< largest squared residual of each sweep
  const double* split_impulse_residuals;  ///< largest squared residual of each split impulse sweep
  std::uint64_t split_impulses;           ///< number of contacts with a split impulse
  bool broken;                            ///< a value is infinite or NaN
};

/// Solves a group with the number of sweeps that the threshold requires. All sweeps overlap, so the
/// number is known only afterwards: the group is then solved again with that number of sweeps.
/// @param run GroupResults(iterations, split impulse iterations)
template <class Run>
rows::RowSweepReport sweep_until_small(const GroupSweeps& sweeps, const Run& run) {
  const auto needed = [&](const double* residuals, int iterations) {
    int i = 0;
    while (i + 1 < iterations && !(residuals[i] <= static_cast<double>(sweeps.threshold))) ++i;
    return i + 1;
  };
  int main = sweeps.iterations, split = sweeps.split_impulse_count > 0 ? sweeps.iterations : 0;
  while (true) {
    const GroupResults results = run(main, split);
    if (results.broken) return {.broken = true};
    const int main_needed = needed(results.residuals, main);
    const int split_needed =
        results.split_impulses > 0 ? needed(results.split_impulse_residuals, split) : split;
    if (main_needed == main && split_needed == split) {
      return {.iterations = main,
              .residual = static_cast<Real>(results.residuals[main - 1]),
              .split_impulses = results.split_impulses * static_cast<std::uint64_t>(split)};
    }
    main = main_needed;
    split = split_needed;
  }
}

/// The passes over all contacts, and over the contacts with a split impulse.
inline rows::RowProgram main_program(const GroupSweeps& sweeps, int iterations,
                                     bool rolling_frictions) {
  rows::RowProgram program{.steps = {},
                           .steps_per_iteration = 0,
                           .iterations = static_cast<std::uint32_t>(iterations),
                           .warm_starts = sweeps.warm_start ? 1u : 0u,
                           .directions = sweeps.directions};
  const auto add = [&](rows::RowStep step) { program.steps[program.steps_per_iteration++] = step; };
  if (sweeps.interleave) {
    add(rows::RowStep::both);
  } else {
    add(rows::RowStep::contacts);
    add(rows::RowStep::frictions);
  }
  if (rolling_frictions) add(rows::RowStep::rolling_frictions);
  return program;
}
inline rows::RowProgram split_impulse_program(int iterations) {
  return {.steps = {rows::RowStep::split_impulse},
          .steps_per_iteration = 1,
          .iterations = static_cast<std::uint32_t>(iterations),
          .warm_starts = 0,
          .directions = 1};
}

}  // namespace JFPX_ABI
}  // namespace jfpx
