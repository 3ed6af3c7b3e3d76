/// A device for groups of contacts that isn't one: its walkers are those of the kernels, but run on
/// this thread, in an order drawn at random, on as few or many threads as is asked for.
#pragma once

#include <jfpx/error.hpp>
#include <jfpx/random.hpp>

#include "src/contact_solver/group_solver.hpp"

#include <algorithm>
#include <functional>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

class GroupDouble final : public GroupSolver {
 public:
  explicit GroupDouble(std::uint64_t seed) : random_(seed) {}

  std::uint32_t threads = 0;                   ///< 0: as many as are drawn each time
  std::function<void()> before_solve = [] {};  ///< may throw
  /// Wrong in the last bits of one velocity: for tests of tests.
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
               size.rolling_frictions * rows::kRollingFrictionRows * rows::kFrictionFields);
    }
    in.places = take(places_, size.contacts);
    in.place_contacts = take(place_contacts_, size.contacts);
    in.moves = take(moves_, size.bodies);
    in.push_places = take(push_places_, size.contacts);
    in.push_moves = take(push_moves_, size.bodies);
    return in;
  }

  rows::RowSweepReport solve(const GroupSweeps& sweeps) override {
    before_solve();
    return sweep_until_small(sweeps, [&](int main, int push) { return run(sweeps, main, push); });
  }
  const rows::ContactOutcome* outcomes() const override { return outcomes_.data(); }
  const Real* velocities() const override { return velocities_.data(); }

 private:
  struct Cells {
    static rows::Cell load(const rows::Cell* p) { return *p; }
    static void store(rows::Cell* p, const rows::Cell& cell) { *p = cell; }
  };
  struct Found {
    double* largest;
    bool is_broken = false;
    void raise(std::uint32_t iteration, Real squared) {
      largest[iteration] = std::max(largest[iteration], static_cast<double>(squared));
    }
    void broken() { is_broken = true; }
  };

  GroupFindings run(const GroupSweeps& sweeps, int main, int push) {
    const rows::RowGroupArrays group = arrays(sweeps);
    residuals_.assign(2 * static_cast<std::size_t>(sweeps.iterations), 0);
    GroupFindings findings{.residuals = residuals_.data(),
                           .push_residuals = residuals_.data() + sweeps.iterations,
                           .pushing = 0,
                           .broken = false};
    for (std::uint32_t i = 0; i < size_.contacts; ++i) {
      if (rows::set_up_place(group, i)) ++findings.pushing;
    }
    Found found{residuals_.data()}, push_found{residuals_.data() + sweeps.iterations};
    if (size_.factors) {
      walk<true, false>(group, main_program(sweeps, main, size_.rolling_frictions > 0), &found);
      walk<true, true>(group, push_program(push), &push_found);
    } else {
      walk<false, false>(group, main_program(sweeps, main, size_.rolling_frictions > 0), &found);
      walk<false, true>(group, push_program(push), &push_found);
    }
    findings.broken = found.is_broken || push_found.is_broken;
    for (std::uint32_t i = 0; i < size_.contacts; ++i) {
      if (!rows::finish_place(group, i)) findings.broken = true;
    }
    for (std::uint32_t i = 0; i < size_.bodies; ++i) {
      if (!rows::finish_body(group, i)) findings.broken = true;
    }
    if (slightly_wrong) {
      const std::int32_t body = std::max(places_[0].a, places_[0].b);
      Real& value =
          velocities_[static_cast<std::size_t>(std::max(body, 0)) * rows::kOutcomeVelocities];
      value += 4 * kEpsilon * (1 + absolute(value));
    }
    return findings;
  }

  rows::RowGroupArrays arrays(const GroupSweeps& sweeps) {
    // Poisoned, so that what nobody writes shows.
    contact_rows_.assign(size_.contacts * rows::kContactFields, kPoison);
    friction_rows_.assign(size_.contacts * sweeps.directions * rows::kFrictionFields, kPoison);
    outcomes_.resize(size_.contacts);
    velocities_.assign(size_.bodies * rows::kOutcomeVelocities, kPoison);
    cells_.assign(2 * size_.bodies * rows::kBodyCells, {});
    rows::RowGroupArrays group{};
    group.settings = sweeps.settings;
    group.main = {places_.data(), moves_.data(), cells_.data(),
                  static_cast<std::uint32_t>(size_.contacts)};
    group.push = {push_places_.data(), push_moves_.data(),
                  cells_.data() + size_.bodies * rows::kBodyCells, sweeps.push_count};
    group.bodies = bodies_.data();
    group.factors = size_.factors ? factors_.data() : nullptr;
    group.inputs = contacts_.data();
    group.contacts = place_contacts_.data();
    group.rolling_frictions = size_.rolling_frictions > 0 ? rolling_frictions_.data() : nullptr;
    group.rolling_friction_rows = rolling_friction_rows_.data();
    group.contact_rows = contact_rows_.data();
    group.friction_rows = friction_rows_.data();
    group.outcomes = outcomes_.data();
    group.velocities = velocities_.data();
    group.bodies_count = static_cast<std::uint32_t>(size_.bodies);
    group.directions = sweeps.directions;
    return group;
  }

  /// Steps walkers at random until all are done.
  template <bool kFactors, bool kPush>
  void walk(const rows::RowGroupArrays& group, const rows::RowProgram& program, Found* found) {
    using Walker = rows::RowWalker<Cells, kFactors, kPush>;
    const std::uint32_t places = kPush ? group.push.count : group.main.count;
    const std::uint32_t count =
        threads != 0 ? threads : 1 + static_cast<std::uint32_t>(random_.below(places + 2));
    std::vector<Walker> walkers;
    walkers.reserve(count);
    for (std::uint32_t i = 0; i < count; ++i) walkers.emplace_back(group, program, i, count);
    std::vector<std::size_t> left;
    for (std::size_t i = 0; i < walkers.size(); ++i) {
      if (!walkers[i].done()) left.push_back(i);
    }
    std::uint64_t in_vain = 0;
    while (!left.empty()) {
      const std::size_t k = random_.below(left.size());
      Walker& walker = walkers[left[k]];
      in_vain = walker.step(found) == 0 ? 0 : in_vain + 1;
      if (in_vain > 1000 + 200 * left.size()) throw DeviceError("walkers wait for each other");
      if (!walker.done()) continue;
      left[k] = left.back();
      left.pop_back();
    }
  }

  static constexpr Real kPoison = Real(1e9);
  Random random_;
  GroupSize size_;
  std::vector<Real> bodies_, factors_, contacts_, rolling_friction_rows_, contact_rows_,
      friction_rows_;
  std::vector<Real> velocities_;
  std::vector<std::uint32_t> rolling_frictions_, place_contacts_, moves_, push_moves_;
  std::vector<rows::Place> places_, push_places_;
  std::vector<rows::Cell> cells_;
  std::vector<rows::ContactOutcome> outcomes_;
  std::vector<double> residuals_;
};

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
