/// Test double of the GPU group solver. It runs the code of the kernels on the host: the workers of
/// any number of simulated threads, interleaved at random on the calling thread.
#pragma once

#include <jfpx/error.hpp>
#include <jfpx/random.hpp>

#include "src/contact_solver/sequential_impulse/group_solver.hpp"

#include <algorithm>
#include <functional>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

class HostGroupSolver final : public GroupSolver {
 public:
  explicit HostGroupSolver(std::uint64_t seed) : random_(seed) {}

  std::uint32_t threads = 0;  ///< simulated threads; 0: a random number in every run
  std::function<void()> before_solve = [] {};  ///< may throw
  /// Adds an error in the last bits of one velocity, so that tests can be tested.
  bool slightly_wrong = false;

  GroupInputs inputs(const GroupSize& size) override {
    size_ = size;
    const auto take = [](auto& values, std::size_t count) {
      values.resize(count);
      return values.data();
    };
    GroupInputs in{};
    in.bodies = take(bodies_, size.bodies * rows::kBodyFields);
    if (size.factors) in.factors = take(factors_, size.bodies * rows::kFactorFields);
    in.contacts = take(contacts_, size.contacts * rows::kInputFields);
    if (size.rolling_frictions > 0) {
      in.rolling_frictions = take(rolling_frictions_, size.contacts);
      in.rolling_friction_rows =
          take(rolling_friction_rows_,
               size.rolling_frictions * rows::kRollingRows * rows::kRollingFields);
    }
    in.schedule = take(schedule_, size.contacts);
    in.slot_contacts = take(slot_contacts_, size.contacts);
    in.contact_counts = take(contact_counts_, size.bodies);
    in.split_impulse_schedule = take(split_impulse_schedule_, size.contacts);
    in.split_impulse_counts = take(split_impulse_counts_, size.bodies);
    return in;
  }

  rows::RowSweepReport solve(const GroupSweeps& sweeps) override {
    before_solve();
    return sweep_until_small(
        sweeps, [&](int main, int split_impulse) { return run(sweeps, main, split_impulse); });
  }
  const rows::ContactOutcome* outcomes() const override { return outcomes_.data(); }
  const Real* velocities() const override { return velocities_.data(); }

 private:
  struct Cells {
    static Cell load(const Cell* p) { return *p; }
    static void store(Cell* p, const Cell& cell) { *p = cell; }
  };
  struct Results {
    double* largest;
    bool is_broken = false;
    void raise(std::uint32_t iteration, Real squared) {
      largest[iteration] = std::max(largest[iteration], static_cast<double>(squared));
    }
    void broken() { is_broken = true; }
  };

  GroupResults run(const GroupSweeps& sweeps, int main, int split_impulse) {
    const rows::RowGroupArrays group = arrays(sweeps);
    residuals_.assign(2 * static_cast<std::size_t>(sweeps.iterations), 0);
    GroupResults results{.residuals = residuals_.data(),
                         .split_impulse_residuals = residuals_.data() + sweeps.iterations,
                         .split_impulses = 0,
                         .broken = false};
    for (std::uint32_t i = 0; i < size_.contacts; ++i) {
      if (rows::set_up_slot(group, i)) ++results.split_impulses;
    }
    Results main_results{residuals_.data()};
    Results split_results{residuals_.data() + sweeps.iterations};
    if (size_.factors) {
      run_workers<true, false>(group, main_program(sweeps, main, size_.rolling_frictions > 0),
                               &main_results);
      run_workers<true, true>(group, split_impulse_program(split_impulse), &split_results);
    } else {
      run_workers<false, false>(group, main_program(sweeps, main, size_.rolling_frictions > 0),
                                &main_results);
      run_workers<false, true>(group, split_impulse_program(split_impulse), &split_results);
    }
    results.broken = main_results.is_broken || split_results.is_broken;
    for (std::uint32_t i = 0; i < size_.contacts; ++i) {
      if (!rows::finish_slot(group, i)) results.broken = true;
    }
    for (std::uint32_t i = 0; i < size_.bodies; ++i) {
      if (!rows::finish_body(group, i)) results.broken = true;
    }
    if (slightly_wrong) {
      const std::int32_t body = std::max(schedule_[0].a, schedule_[0].b);
      Real& value =
          velocities_[static_cast<std::size_t>(std::max(body, 0)) * rows::kOutcomeVelocities];
      value += 4 * kEpsilon * (1 + absolute(value));
    }
    return results;
  }

  rows::RowGroupArrays arrays(const GroupSweeps& sweeps) {
    // Poisoned, so that a value that is never written is noticed.
    contact_rows_.assign(size_.contacts * rows::kContactFields, kPoison);
    friction_rows_.assign(size_.contacts * sweeps.directions * rows::kFrictionFields, kPoison);
    outcomes_.resize(size_.contacts);
    velocities_.assign(size_.bodies * rows::kOutcomeVelocities, kPoison);
    cells_.assign(2 * size_.bodies * rows::kBodyCells, {});
    rows::RowGroupArrays group{};
    group.settings = sweeps.settings;
    group.main = {schedule_.data(), contact_counts_.data(), cells_.data(),
                  static_cast<std::uint32_t>(size_.contacts)};
    group.split_impulse = {split_impulse_schedule_.data(), split_impulse_counts_.data(),
                           cells_.data() + size_.bodies * rows::kBodyCells,
                           sweeps.split_impulse_count};
    group.bodies = bodies_.data();
    group.factors = size_.factors ? factors_.data() : nullptr;
    group.inputs = contacts_.data();
    group.contacts = slot_contacts_.data();
    group.rolling_frictions = size_.rolling_frictions > 0 ? rolling_frictions_.data() : nullptr;
    group.rolling_friction_rows = rolling_friction_rows_.data();
    group.contact_rows = contact_rows_.data();
    group.friction_rows = friction_rows_.data();
    group.outcomes = outcomes_.data();
    group.velocities = velocities_.data();
    group.body_count = static_cast<std::uint32_t>(size_.bodies);
    group.directions = sweeps.directions;
    return group;
  }

  /// Steps random workers until all are done.
  template <bool kFactors, bool kSplitImpulse>
  void run_workers(const rows::RowGroupArrays& group, const rows::RowProgram& program,
                   Results* results) {
    using Worker = rows::SweepWorker<Cells, kFactors, kSplitImpulse>;
    const std::uint32_t contacts = kSplitImpulse ? group.split_impulse.count : group.main.count;
    const std::uint32_t count =
        threads != 0 ? threads : 1 + static_cast<std::uint32_t>(random_.below(contacts + 2));
    std::vector<Worker> workers;
    workers.reserve(count);
    for (std::uint32_t i = 0; i < count; ++i) workers.emplace_back(group, program, i, count);
    std::vector<std::size_t> running;
    for (std::size_t i = 0; i < workers.size(); ++i) {
      if (!workers[i].done()) running.push_back(i);
    }
    std::uint64_t failed_polls = 0;
    while (!running.empty()) {
      const std::size_t k = random_.below(running.size());
      Worker& worker = workers[running[k]];
      failed_polls = worker.step(results) == 0 ? 0 : failed_polls + 1;
      if (failed_polls > 1000 + 200 * running.size())
        throw DeviceError("the workers wait for each other");
      if (!worker.done()) continue;
      running[k] = running.back();
      running.pop_back();
    }
  }

  static constexpr Real kPoison = Real(1e9);
  Random random_;
  GroupSize size_;
  std::vector<Real> bodies_, factors_, contacts_, rolling_friction_rows_, contact_rows_,
      friction_rows_;
  std::vector<Real> velocities_;
  std::vector<std::uint32_t> rolling_frictions_, slot_contacts_, contact_counts_,
      split_impulse_counts_;
  std::vector<rows::ScheduledContact> schedule_, split_impulse_schedule_;
  std::vector<Cell> cells_;
  std::vector<rows::ContactOutcome> outcomes_;
  std::vector<double> residuals_;
};

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
