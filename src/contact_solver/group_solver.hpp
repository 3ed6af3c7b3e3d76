/// Solves whole groups of contacts somewhere else than on this processor.
#pragma once

#include <jfpx/config.hpp>

#include "src/contact_solver/row_walk.hpp"

#include <functional>
#include <memory>
#include <span>

namespace jfpx {
inline namespace JFPX_ABI {

/// How much there is to solve.
struct GroupSize {
  std::size_t bodies = 0;             ///< with Bullet's fixed one, number 0
  std::size_t contacts = 0;           ///< at least 1, fewer than 2^31
  std::size_t rolling_frictions = 0;  ///< contacts with rows against rolling and spinning
  bool factors = false;               ///< some body has a factor other than 1
};

/// Where the inputs of a group are to be put.
struct GroupInputs {
  Real* bodies;                      ///< kBodyFields each
  Real* factors;                     ///< kFactorFields each; null without
  Real* contacts;                    ///< kInputFields each
  std::uint32_t* rolling_frictions;  ///< by contact: which kRollingFrictionRows rows, or
                                     ///< kNoRollingFriction; null without
  Real* rolling_friction_rows;       ///< kRollingFrictionRows * kFrictionFields each
  rows::Place* places;               ///< RowOrder::build()
  std::uint32_t* place_contacts;
  std::uint32_t* moves;      ///< by body
  rows::Place* push_places;  ///< RowOrder::choose(): at most as many as contacts
  std::uint32_t* push_moves;
};

struct GroupSweeps {
  rows::RowSettings settings;
  std::uint32_t push_count = 0;  ///< contacts that may have to be pushed apart
  int iterations = 10;           ///< at least 1, at most kMaxGroupIterations
  Real threshold = 0;            ///< sweeps end when the largest squared residual is no larger
  std::uint32_t directions = 1;  ///< of friction: 1 or 2
  bool interleave = false;       ///< each contact's friction right after it
  bool warm_start = false;       ///< begin with the impulses of the contacts
};
inline constexpr int kMaxGroupIterations = 1024;

/// Results are valid until the next call of inputs(). One thread at a time.
class JFPX_API GroupSolver {
 public:
  virtual ~GroupSolver() = default;
  GroupSolver(const GroupSolver&) = delete;
  GroupSolver& operator=(const GroupSolver&) = delete;

  /// Room for the inputs of a group, not initialised; any threads may fill it.
  /// @throws DeviceError, OutOfMemory
  virtual GroupInputs inputs(const GroupSize& size) = 0;
  /// Solves the group whose inputs are there. @throws DeviceError, OutOfMemory
  virtual rows::RowSweepReport solve(const GroupSweeps& sweeps) = 0;
  /// By contact.
  virtual const rows::ContactOutcome* outcomes() const = 0;
  /// By body: kOutcomeVelocities numbers each.
  virtual const Real* velocities() const = 0;

 protected:
  GroupSolver() = default;
};

using GroupSolverMaker = std::function<std::unique_ptr<GroupSolver>()>;
/// Makes solvers on the GPU with this ordinal; null in a build without CUDA.
JFPX_API GroupSolverMaker cuda_group_solver_maker(int device);

/// What one run over a group found out.
struct GroupFindings {
  const double* residuals;       ///< largest squared one of each sweep
  const double* push_residuals;  ///< and of each sweep against penetration
  std::uint64_t pushing;         ///< contacts that are to be pushed apart
  bool broken;                   ///< something is not a finite number
};

/// All sweeps are under way at once, so it shows only afterwards when one should have been the
/// last: the group is then solved once more, with so many.
/// @param run GroupFindings(iterations, push iterations)
template <class Run>
rows::RowSweepReport sweep_until_small(const GroupSweeps& sweeps, const Run& run) {
  const auto needed = [&](const double* residuals, int iterations) {
    int i = 0;
    while (i + 1 < iterations && !(residuals[i] <= static_cast<double>(sweeps.threshold))) ++i;
    return i + 1;
  };
  int main = sweeps.iterations, push = sweeps.push_count > 0 ? sweeps.iterations : 0;
  while (true) {
    const GroupFindings found = run(main, push);
    if (found.broken) return {.broken = true};
    const int main_needed = needed(found.residuals, main);
    const int push_needed = found.pushing > 0 ? needed(found.push_residuals, push) : push;
    if (main_needed == main && push_needed == push) {
      return {.iterations = main,
              .residual = static_cast<Real>(found.residuals[main - 1]),
              .pushed = found.pushing * static_cast<std::uint64_t>(push)};
    }
    main = main_needed;
    push = push_needed;
  }
}

/// The passes over all contacts, and over those to be pushed apart.
inline rows::RowProgram main_program(const GroupSweeps& sweeps, int iterations,
                                     bool rolling_frictions) {
  rows::RowProgram program{.steps = {},
                           .steps_an_iteration = 0,
                           .iterations = static_cast<std::uint32_t>(iterations),
                           .warm_starts = sweeps.warm_start ? 1u : 0u,
                           .directions = sweeps.directions};
  const auto add = [&](rows::RowStep step) { program.steps[program.steps_an_iteration++] = step; };
  if (sweeps.interleave) {
    add(rows::RowStep::both);
  } else {
    add(rows::RowStep::contacts);
    add(rows::RowStep::frictions);
  }
  if (rolling_frictions) add(rows::RowStep::rolling_frictions);
  return program;
}
inline rows::RowProgram push_program(int iterations) {
  return {.steps = {rows::RowStep::push},
          .steps_an_iteration = 1,
          .iterations = static_cast<std::uint32_t>(iterations),
          .warm_starts = 0,
          .directions = 1};
}

}  // namespace JFPX_ABI
}  // namespace jfpx
