/// Substeps and restitution of a soft step on a device.
#pragma once

#include "src/world/device/row_solver.hpp"
#include "src/world/device/warp_items.hpp"

#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Sweeps over all rows of a world that is one block, as soft_step::SoftStepSolver, without
/// barriers: a row waits only for the earlier rows of its two bodies (see Tickets), so that
/// consecutive colors and sweeps overlap. After the rows of a sweep, each body solves its rows with
/// fixed bodies and completes its part of the substep. Threads exchange only the motion of bodies:
/// Team::run_dataflow() assigns a row to the same thread in all sweeps, and all other arrays by
/// body are constant or written only by the thread of the body.
///
/// There is no deadlock. All blocks are resident, and the warps take their items in the order of
/// the sweeps. The items of a warp do not wait for each other, and an item waits only for items of
/// lower warps and earlier calls. So all items of the first incomplete warp are ready.
/// @tparam kKinds number of kinds of rows that occur, which are the first ones: a program without
///   rows of joints needs fewer registers
template <soft_step::RowKind kKinds>
struct SolveProgram : RowSolver<kKinds, BodyCells> {
  static constexpr unsigned kBlocksPerMultiprocessor = tuning::kSolve;
  /// Minimum number of items of the launch per thread for more than one block per multiprocessor.
  /// Waiting threads poll memory, so a second block pays only if rows rarely wait.
  static constexpr std::size_t kItemsPerThread = 8;
  /// Number of items of the launch for each row of a manifold or joint: only one to four lanes of a
  /// warp have such a row.
  static constexpr std::size_t kItemsPerOtherRow = 32;
  static constexpr std::size_t kSharedBytes = sizeof(ColoredRows);
  using RowSolver<kKinds, BodyCells>::data;

  /// The sequence is that of SoftStep::solve(). Sweep 0 is the warm start. Each substep has sweeps
  /// over joints, a bias sweep, after which the bodies move, and kRelaxSweeps relax sweeps. The
  /// last sweep is the restitution. Sweep::moves() and the highest ticket of BodyCells depend on
  /// this.
  template <class Team>
  [[gnu::always_inline]] JFPX_HD void operator()(const Team& team) const {
    if (data.has_failed()) return;
    const StepData& d = data;
    const bool rebounds = d.counters->any_rebound != 0;
    const SweepList sweeps{d.substeps, rebounds, d.joint_sweeps()};
    const RowBins& bins = team.cached_bins(d.bins);
    const Items items{start_rows(team, bins),
                      {d.step.bodies.count, team.warps(), 0, WarpItems::kLog2OfLanes}};
    Sweep sweep(bins, sweeps);
    run(team, items, sweep, soft_step::WarmStart{});
    for (std::uint32_t substep = 0; substep < d.substeps; ++substep) {
      const bool is_last = substep + 1 == d.substeps;
      if constexpr (kKinds > soft_step::kContactRowKinds) {
        for (std::uint32_t k = 0; k < sweeps.joint_sweeps; ++k) {
          sweep.start(BodyStage::none);
          run(team, items, sweep, soft_step::SolveJoints{{d.constants, k == 0}});
        }
      }
      sweep.start(BodyStage::move);
      run(team, items, sweep, soft_step::Solve<true>{d.constants});
      for (std::uint32_t k = 1; k <= soft_step::kRelaxSweeps; ++k) {
        const bool ends_substep = k == soft_step::kRelaxSweeps;
        sweep.start(!ends_substep ? BodyStage::none
                    : !is_last    ? BodyStage::accelerate
                    : rebounds    ? BodyStage::none
                                  : BodyStage::finish);
        run(team, items, sweep, soft_step::Solve<false>{d.constants});
      }
    }
    if (!rebounds) return;
    sweep.start(BodyStage::finish);
    run(team, items, sweep, soft_step::Restitute{});
  }

 private:
  using Base = RowSolver<kKinds, BodyCells>;
  using typename Base::BodyFree, typename Base::ItemBody, typename Base::SolverBody;

  /// The items of the dataflows of a sweep.
  struct Items {
    const ColoredRows& rows;
    WarpItems bodies;
  };

  struct BodyItem : ItemBody {
    bool is_active = false;             ///< whether the body is movable and awake
    std::uint32_t first_fixed = kNone;  ///< of its rows with fixed bodies
  };

  /// The bodies after the rows of a sweep, for Team::run_dataflow().
  template <class Operation>
  class BodyDataflow {
   public:
    using Item = BodyItem;
    JFPX_HD BodyDataflow(const SolveProgram& program, const Sweep& sweep,
                         const Operation& operation, const WarpItems& items)
        : program_(program), sweep_(sweep), operation_(operation), items_(items) {}

    JFPX_HD void begin(std::uint32_t i, BodyItem* item) const {
      const BodyView& bodies = program_.data.step.bodies;
      const std::uint32_t number = items_.find(i, bodies.count);
      if (number != kNone) program_.begin_body(sweep_, bodies.ids[number].index, item);
    }
    JFPX_HD bool is_ready(BodyItem* item) const {
      if (item->is_active && !item->is_ready) item->template read<true>(program_.data);
      return item->is_ready || !item->is_active;
    }
    JFPX_HD void complete(BodyItem* item) const {
      program_.complete_body(sweep_, operation_, item);
    }

   private:
    const SolveProgram& program_;
    const Sweep& sweep_;
    const Operation& operation_;
    const WarpItems& items_;
  };

  template <class Team>
  JFPX_HD static const ColoredRows& start_rows(const Team& team, const RowBins& bins) {
    const auto threads = team.threads();
    auto* const rows = static_cast<ColoredRows*>(threads.shared(kSharedBytes));
    rows->start(threads, bins, team.warps());
    return *rows;
  }

  template <class Team, class Operation>
  [[gnu::always_inline]] JFPX_HD void run(const Team& team, const Items& items, const Sweep& sweep,
                                          const Operation& operation) const {
    if (sweep.overflow() > 0) {
      team.sync();
      team.once([&] { this->run_overflow(sweep, operation, Tickets(sweep.number, 0).first); });
      team.sync();
    }
    using Rows = typename Base::template RowDataflow<Operation>;
    team.run_dataflow(items.rows.items(), Rows(*this, sweep, operation, items.rows));
    team.run_dataflow(items.bodies.items(data.step.bodies.count),
                      BodyDataflow<Operation>(*this, sweep, operation, items.bodies));
  }

  JFPX_HD void begin_body(const Sweep& sweep, std::uint32_t body, BodyItem* item) const {
    const StepData& d = data;
    const RowBody constants = d.row_bodies[body];
    item->start(body, d);
    item->is_active = constants.inverse_mass > 0;
    item->first_fixed = d.first_fixed[body];
    const Tickets tickets(sweep.number, constants.colors);
    item->before = tickets.last();
    item->after = Tickets(sweep.number + 1, 0).first;
  }

  template <class Operation>
  JFPX_HD void complete_body(const Sweep& sweep, const Operation& operation, BodyItem* item) const {
    const StepData& d = data;
    const std::uint32_t i = item->index;
    if (i == kNone) return;
    if (!item->is_active) {
      if (sweep.stage == BodyStage::finish) this->finish_kinematic(i);
      return;
    }
    SolverBody& body = item->motion;
    const BodyCells cells(d.columns, i);
    BodyFree free;
    for (std::uint32_t r = item->first_fixed; r != kNone;) {
      const std::uint32_t next = d.next_fixed[r];
      this->solve_fixed(sweep, operation, r, item, &free);
      r = next;
    }
    if (sweep.stage == BodyStage::finish) {
      d.step.solver[i] = body;
      this->check_state(i);
      return;
    }
    if (sweep.stage == BodyStage::move) {
      this->move(i, i, sweep.moves() + 1, d.orientation[i], &body);
    }
    if (sweep.stage == BodyStage::accelerate) {
      free.read(cells, item->version);
      d.step.accelerate(i, d.substep_bodies.load(i), d.orientation[i], &body, &free.motion, false);
      free.is_changed = true;
    }
    cells.write_shift(body, &item->version);
    cells.write_rotation(body, &item->version);
    if (free.is_changed) cells.write_free(free.motion, &item->version);
    cells.write(item->after, body, item->version);
  }
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
