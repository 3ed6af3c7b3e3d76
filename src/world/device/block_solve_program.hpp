/// Substeps and restitution of a soft step on a device, for worlds that are divided into blocks.
#pragma once

#include "src/world/device/ahead.hpp"
#include "src/world/device/block_motion.hpp"
#include "src/world/device/row_solver.hpp"
#include "src/world/device/step_data.hpp"
#include "src/world/device/sweep.hpp"

#include <cstddef>
#include <cstdint>
#include <tuple>
#include <type_traits>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Number of kinds of rows of a step in which all rows are of spheres.
inline constexpr soft_step::RowKind kSphereRowKinds = soft_step::kKindOf<soft_step::SphereRow> + 1;

/// Work of the blocks between the crossing rows of two sweeps. It completes the sweep before, with
/// the rows with fixed bodies, and the substep, and solves the inner rows of a sweep.
struct BlockPhase {
  SweepList sweeps;
  std::uint32_t sweep = 0;  ///< of the inner rows
  bool has_bodies = true;   ///< whether the sweep before is completed
  bool has_rows = true;     ///< whether inner rows are solved

  JFPX_HD BodyStage stage() const {
    return has_bodies ? sweeps.stage_before(sweep) : BodyStage::none;
  }
  JFPX_HD SweepKind inner_sweep() const { return has_rows ? sweeps.kind(sweep) : SweepKind::none; }
  /// Sweep of the rows with fixed bodies.
  JFPX_HD SweepKind fixed_sweep() const {
    return has_bodies && sweep > 0 ? sweeps.kind(sweep - 1) : SweepKind::none;
  }
};

/// Sweeps over all rows, as soft_step::SoftStepSolver, in one launch.
///
/// A block of threads solves the inner rows of a block of bodies in shared memory. Before them, it
/// completes the sweep before, with the rows of these bodies with fixed bodies, and the substep.
/// All threads solve the crossing rows, with a barrier after each color. Between two barriers, the
/// motion of a body is accessed only by one row, or by the threads of its block.
/// @tparam kKinds number of kinds of rows that occur, which are the first ones: a program with
///   fewer kinds needs fewer registers and less shared memory
template <soft_step::RowKind kKinds>
struct BlockSolveProgram : RowSolver<kKinds, BodyMotion> {
  using Motion = BlockMotion<kKinds>;
  static constexpr std::size_t kRowsBegin = (Motion::kBytes / 16 + 1) * 16;
  using RowAhead = Ahead<soft_step::SphereRow, kRowsBegin>;
  static constexpr unsigned kBlocksPerMultiprocessor = tuning::kSolve;
  static constexpr std::size_t kSharedBytes =
      kKinds == kSphereRowKinds ? kRowsBegin + RowAhead::kBytes : Motion::kBytes;
  using RowSolver<kKinds, BodyMotion>::data;

  /// The sequence is that of SoftStep::solve().
  template <class Team>
  [[gnu::always_inline]] JFPX_HD void operator()(const Team& team) const {
    if (data.has_failed() || !is_selected()) return;
    const StepData& d = data;
    const SweepList sweeps{d.substeps, d.counters->any_rebound != 0, d.joint_sweeps()};
    Sweep sweep(team.cached_bins(d.bins), sweeps);
    const bool has_overflow = overflow_rows(d.bins->begin) > 0;
    for (std::uint32_t s = 0; s <= sweeps.size(); ++s) {
      sweep.number = s;
      BlockPhase phase{.sweeps = sweeps, .sweep = s};
      if (has_overflow && s < sweeps.size()) {
        phase.has_rows = false;
        run_blocks(team, sweep, phase);
        team.sync();
        team.once([&] {
          visit_operation(sweeps.kind(s),
                          [&](const auto& operation) { this->run_overflow(sweep, operation, 0); });
        });
        team.sync();
        phase.has_rows = true;
        phase.has_bodies = false;
      }
      run_blocks(team, sweep, phase);
      if (s == sweeps.size()) break;
      team.sync();
      solve_crossing(team, sweep);
    }
    team.for_each_nowait(d.step.bodies.count, [&](std::uint32_t i) {
      this->finish_kinematic(d.step.bodies.ids[i].index);
    });
  }

 private:
  using Base = RowSolver<kKinds, BodyMotion>;
  using typename Base::BodyFree, typename Base::Impact, typename Base::ItemBody,
      typename Base::SolverBody;

  /// Whether this program has the kinds of rows of the step, and no program with fewer kinds has.
  JFPX_HD bool is_selected() const {
    if (data.world_joints.count > 0) return kKinds == soft_step::kRowKinds;
    const bool has_manifolds = data.counters->manifold_rows > 0;
    return kKinds == (has_manifolds ? soft_step::kContactRowKinds : kSphereRowKinds);
  }

  /// Calls f(operation) with the operation of a sweep, if there is one.
  template <class F>
  [[gnu::always_inline]] JFPX_HD void visit_operation(SweepKind kind, const F& f) const {
    switch (kind) {
      case SweepKind::none:
        return;
      case SweepKind::warm_start:
        return f(soft_step::WarmStart{});
      case SweepKind::first_joints:
      case SweepKind::joints:
        if constexpr (kKinds > soft_step::kContactRowKinds) {
          f(soft_step::SolveJoints{{data.constants, kind == SweepKind::first_joints}});
        }
        return;
      case SweepKind::bias:
        return f(soft_step::Solve<true>{data.constants});
      case SweepKind::relax:
        return f(soft_step::Solve<false>{data.constants});
      case SweepKind::restitution:
        return f(soft_step::Restitute{});
    }
  }

  /// Solves the crossing rows of a sweep. Begins after a barrier, and ends with one.
  template <class Team>
  [[gnu::always_inline]] JFPX_HD void solve_crossing(const Team& team, const Sweep& sweep) const {
    visit_operation(sweep.kind(), [&](const auto& operation) {
      if constexpr (kKinds == kSphereRowKinds) {
        solve_crossing_spheres(team, sweep, operation);
      } else {
        solve_crossing_kinds(team, sweep, operation);
      }
    });
  }

  /// solve_crossing() if all rows are of spheres.
  template <class Team, class Operation>
  [[gnu::always_inline]] JFPX_HD void solve_crossing_spheres(const Team& team, const Sweep& sweep,
                                                             const Operation& operation) const {
    constexpr soft_step::RowKind kKind = soft_step::kKindOf<soft_step::SphereRow>;
    const std::uint32_t* const begin =
        sweep.begin + soft_step::bin_of(kKind, soft_step::group_of_crossing(0));
    const std::uint32_t colors = sweep.bins.crossing_colors;
    const auto has_color = [&](std::uint32_t color) { return color < colors; };
    team.for_each_thread([&](std::uint32_t thread, std::uint32_t count, const auto& sync) {
      ThreadRows rows(data.sphere_rows, begin, thread, count);
      rows.run(has_color, sync, [&](std::uint32_t r, const auto& row) {
        typename Base::RowItem item;
        this->begin_row(r, row, &item);
        this->read_bodies(&item);
        this->solve_row(sweep, operation, &item);
      });
    });
  }

  /// solve_crossing() for rows of several kinds.
  template <class Team, class Operation>
  [[gnu::always_inline]] JFPX_HD void solve_crossing_kinds(const Team& team, const Sweep& sweep,
                                                           const Operation& operation) const {
    const auto part = team.team_of_part();
    const std::uint32_t colors = sweep.bins.crossing_colors;
    for (std::uint32_t color = 0; color < colors; ++color) {
      for (soft_step::RowKind kind = 0; kind < kKinds; ++kind) {
        const std::uint32_t bin = soft_step::bin_of(kind, soft_step::group_of_crossing(color));
        const std::uint32_t first = sweep.begin[bin], rows = sweep.size(bin);
        part.for_each_nowait(rows, [&](std::uint32_t i) {
          typename Base::RowItem item;
          this->begin_row(sweep, first + i, &item);
          this->read_bodies(&item);
          this->solve_row(sweep, operation, &item);
        });
      }
      team.sync();
    }
  }

  /// The rows of spheres of a thread, color by color. A thread loads its next row before it solves
  /// a row.
  class ThreadRows {
   public:
    /// Starts to load the first row.
    /// @param begin  the first rows by color, and the end
    /// @param thread number of the thread among `count` that share the rows of a color
    JFPX_HD ThreadRows(const StripedArray<soft_step::SphereRow>& rows, const std::uint32_t* begin,
                       std::uint32_t thread, std::uint32_t count)
        : rows_(rows), begin_(begin), thread_(thread), count_(count) {
      load(0, begin[0] + thread);
    }

    /// Calls solve(r, row) for the rows of each color, and sync() after each color.
    /// @param has_color whether a color is below the end of the colors
    template <class HasColor, class Sync, class Solve>
    [[gnu::always_inline]] JFPX_HD void run(const HasColor& has_color, const Sync& sync,
                                            const Solve& solve) {
      for (std::uint32_t color = 0; has_color(color); ++color) {
        while (next_ < begin_[color + 1]) {
          const std::uint32_t r = next_;
          const soft_step::SphereRow row = ahead_.get();
          load(color, r + count_);
          solve(r, row);
        }
        sync();
      }
    }

   private:
    /// Starts to load a row of a color, or the first one of a later color.
    JFPX_HD void load(std::uint32_t color, std::uint32_t row) {
      const std::uint32_t end = begin_[soft_step::kColorsPerClass];
      next_ = row;
      // A part may have no rows of colors that other parts have.
      while (next_ >= begin_[color + 1] && begin_[color + 1] < end) {
        ++color;
        next_ = begin_[color] + thread_;
      }
      if (next_ < end) ahead_.load(rows_, next_);
    }

    const StripedArray<soft_step::SphereRow>& rows_;
    const std::uint32_t* begin_;
    std::uint32_t thread_, count_;
    std::uint32_t next_ = 0;  ///< the row that is loaded, or a number beyond all rows
    RowAhead ahead_;
  };

  template <class Team>
  [[gnu::always_inline]] JFPX_HD void run_blocks(const Team& team, const Sweep& sweep,
                                                 const BlockPhase& phase) const {
    Sweep before = sweep;
    if (phase.sweep > 0) before.number = phase.sweep - 1;
    const auto run = [&](std::uint32_t block, const auto& threads) {
      run_block(threads, before, phase, block);
    };
    team.for_blocks(sweep.bins.blocks.all(), run, &data.divisions.blocks);
  }

  /// @param before the sweep before, whose rows with fixed bodies are solved
  template <class Threads>
  [[gnu::always_inline]] JFPX_HD void run_block(const Threads& threads, const Sweep& before,
                                                const BlockPhase& phase,
                                                std::uint32_t block) const {
    const StepData& d = data;
    const BlockCounts& blocks = before.bins.blocks;
    const Range places = blocks.indices_of(block);
    const std::uint32_t count = places.end - places.begin;
    const Motion motion(threads.shared(kSharedBytes));
    const bool has_inner = phase.inner_sweep() != SweepKind::none && block < blocks.placed();
    constexpr std::uint32_t kEnds = soft_step::kColorsPerClass + 1u;
    threads.for_each(kKinds * kEnds, [&](std::uint32_t i) {
      const auto kind = static_cast<soft_step::RowKind>(i / kEnds);
      motion.row_begin(kind)[i % kEnds] = has_inner ? d.inner_begin(block, kind)[i % kEnds] : 0;
    });
    const auto complete = [&] {
      complete_bodies(threads, before, phase, motion, places);
      threads.sync();
    };
    if constexpr (kKinds == kSphereRowKinds) {
      threads.sync();
      solve_inner_spheres(threads, phase, complete, motion, places.begin);
    } else {
      complete();
      visit_operation(phase.inner_sweep(), [&](const auto& operation) {
        solve_inner_kinds(threads, phase, operation, motion, places.begin);
      });
    }
    if (phase.stage() == BodyStage::finish) return;
    threads.for_each(count, [&](std::uint32_t i) { publish(motion, i, places.begin + i); });
  }

  /// Solves the inner rows of a block.
  template <class Threads, class Operation>
  [[gnu::always_inline]] JFPX_HD void solve_inner_kinds(const Threads& threads,
                                                        const BlockPhase& phase,
                                                        const Operation& operation,
                                                        const Motion& motion,
                                                        std::uint32_t first_place) const {
    const StepData& d = data;
    for (std::uint32_t color = 0; color < soft_step::kColorsPerClass; ++color) {
      bool has_rows = false, is_complete = true;
      const auto solve = [&](auto kind) {
        using Row = std::tuple_element_t<decltype(kind)::value, soft_step::RowTypes>;
        const std::uint32_t* begin = motion.row_begin(kind);
        const std::uint32_t first = begin[color], rows = begin[color + 1] - first;
        is_complete = is_complete && begin[soft_step::kColorsPerClass] == first;
        has_rows = has_rows || rows > 0;
        threads.for_each(rows, [&](std::uint32_t i) {
          const std::uint32_t r = first + i;
          if constexpr (std::is_same_v<Row, soft_step::SphereRow>) {
            solve_inner_row(phase, operation, motion, first_place, r, d.sphere_rows.load(r));
          } else {
            solve_inner_row(phase, operation, motion, first_place, r, d.template rows<Row>()[r]);
          }
        });
      };
      for_kinds(solve);
      if (is_complete) return;
      if (has_rows) threads.sync();
    }
  }

  /// Calls complete(), then solves the inner rows of a block, which are all of spheres. The first
  /// rows are loaded during complete().
  template <class Threads, class Complete>
  [[gnu::always_inline]] JFPX_HD void solve_inner_spheres(const Threads& threads,
                                                          const BlockPhase& phase,
                                                          const Complete& complete,
                                                          const Motion& motion,
                                                          std::uint32_t first_place) const {
    const std::uint32_t* const begin = motion.row_begin(0);
    const auto has_color = [&](std::uint32_t color) {
      return begin[color] < begin[soft_step::kColorsPerClass];
    };
    threads.for_each_thread([&](std::uint32_t thread, std::uint32_t count, const auto& sync) {
      ThreadRows rows(data.sphere_rows, begin, thread, count);
      complete();
      visit_operation(phase.inner_sweep(), [&](const auto& operation) {
        rows.run(has_color, sync, [&](std::uint32_t r, const auto& row) {
          solve_inner_row(phase, operation, motion, first_place, r, row);
        });
      });
    });
  }

  /// Calls f with each kind as a constant.
  template <class F>
  JFPX_HD static void for_kinds(const F& f) {
    [&]<std::size_t... kKind>(std::index_sequence<kKind...>) {
      (f(std::integral_constant<soft_step::RowKind, kKind>()), ...);
    }
    (std::make_index_sequence<kKinds>());
  }

  template <class Row, class Operation>
  JFPX_HD void solve_inner_row(const BlockPhase& phase, const Operation& operation,
                               const Motion& motion, std::uint32_t first_place, std::uint32_t r,
                               Row row) const {
    const StepData& d = data;
    constexpr bool kIsSphere = std::is_same_v<Row, soft_step::SphereRow>;
    const std::uint32_t* const body_at = d.body_at + first_place;
    SolverBody a = motion.load(row.a), b = motion.load(row.b);
    const Vec3 shift_a = a.shift, shift_b = b.shift;
    const Impact impact({d.substep_bodies, first_place}, d.columns, row.a);
    soft_step::RowContext<typename Row::Part, Impact> context{
        {&a, &b, nullptr, nullptr}, d.parts_of(row), &impact};
    Mat3 inertia_a, inertia_b;
    if constexpr (!kIsSphere) {
      inertia_a = d.step.bodies.inverse_inertia[body_at[row.a]];
      inertia_b = d.step.bodies.inverse_inertia[body_at[row.b]];
      context.bodies.inertia_a = &inertia_a;
      context.bodies.inertia_b = &inertia_b;
    }
    Quat orientation_a, orientation_b;
    if constexpr (Row::kReadsOrientation) {
      const std::uint32_t moves = phase.sweeps.moves(phase.sweep);
      orientation_a = d.orientation_cells[body_at[row.a]].load(moves);
      orientation_b = d.orientation_cells[body_at[row.b]].load(moves);
      const Quat* start = d.step.bodies.orientation;
      context.orientations = {&orientation_a, &orientation_b, &start[body_at[row.a]],
                              &start[body_at[row.b]]};
    }
    Real restitution = 0;
    if constexpr (kIsSphere) restitution = row.restitution;
    operation.template run<false>(&row, context);
    const auto write = [&](std::uint32_t i, const SolverBody& body, const Vec3& shift) {
      motion.store_velocities(i, body);
      if constexpr (Operation::kMovesBodies) {
        const bool moves = !(body.shift == shift);
        if (!moves && !Row::kReadsRotation) return;
        typename Motion::Changes changes = motion.changes(i);
        if (moves) {
          motion.store_shift(i, body);
          changes.shift = true;
        }
        if constexpr (Row::kReadsRotation) {
          motion.store_rotation(i, body);
          changes.rotation = true;
        }
        motion.set_changes(i, changes);
      }
    };
    write(row.a, a, shift_a);
    write(row.b, b, shift_b);
    if constexpr (Operation::kChangesRow) {
      if constexpr (kIsSphere) {
        this->store_sphere_row(row, restitution, r);
      } else {
        store_changes(row, &d.rows<Row>()[r]);
      }
    }
  }

  /// Makes the motion of a body visible to crossing rows and to the next phase.
  /// @param i     place of the body in its block
  /// @param index its solver index
  JFPX_HD void publish(const Motion& motion, std::uint32_t i, std::uint32_t index) const {
    const SolverBody body = motion.load(i);
    if (!(body.inverse_mass > 0)) return;
    const BodyMotion stored(data.columns, index);
    const typename Motion::Changes changes = motion.changes(i);
    if (changes.shift) stored.write_shift(body);
    if (changes.rotation) stored.write_rotation(body);
    stored.write(0, body);
  }

  /// A body whose sweep is completed.
  struct BodyWork : ItemBody {
    std::uint32_t body = kNone, first_fixed = kNone;
    soft_step::SubstepBody constants;  ///< if it is accelerated
    Quat orientation;                  ///< if it moves, or is accelerated with a gyroscopic term
    BodyFree free;                     ///< if it is accelerated
  };

  /// Completes the sweep before for all bodies of a block, and puts their motion into shared
  /// memory.
  template <class Threads>
  [[gnu::always_inline]] JFPX_HD void complete_bodies(const Threads& threads, const Sweep& before,
                                                      const BlockPhase& phase, const Motion& motion,
                                                      const Range& places) const {
    const std::uint32_t bodies = places.end - places.begin;
    const BodyStage stage = phase.stage();
    threads.for_each_thread([&](std::uint32_t thread, std::uint32_t count, const auto&) {
      // A thread loads its next body while it completes one.
      BodyWork next;
      if (thread < bodies) begin_body(places.begin + thread, &next);
      for (std::uint32_t i = thread; i < bodies; i += count) {
        BodyWork work = next;
        load_body(stage, &work);
        if (i + count < bodies) begin_body(places.begin + i + count, &next);
        complete_body(before, phase, motion, i, &work);
      }
    });
  }

  /// @param i solver index
  JFPX_HD void begin_body(std::uint32_t i, BodyWork* work) const {
    work->index = i;
    work->template read<Motion::kHasRotation>(data);
    work->body = data.body_at[i];
    work->first_fixed = data.first_fixed[i];
  }

  /// Loads what the completion of a stage reads besides begin_body().
  JFPX_HD void load_body(BodyStage stage, BodyWork* work) const {
    const StepData& d = data;
    if (!(work->motion.inverse_mass > 0)) return;
    if (stage == BodyStage::move) work->orientation = d.orientation[work->index];
    if (stage == BodyStage::accelerate) {
      work->constants = d.substep_bodies.load(work->index);
      work->free.read(BodyMotion(d.columns, work->index), work->version);
    }
  }

  /// @param place of the body in its block
  JFPX_HD void complete_body(const Sweep& before, const BlockPhase& phase, const Motion& motion,
                             std::uint32_t place, BodyWork* work) const {
    const StepData& d = data;
    const std::uint32_t i = work->index;
    SolverBody& body = work->motion;
    if (!(body.inverse_mass > 0)) {
      motion.store_velocities(place, {});
      return;
    }
    typename Motion::Changes changes;
    visit_operation(phase.fixed_sweep(), [&](const auto& operation) {
      const Vec3 shift = body.shift;
      for (std::uint32_t r = work->first_fixed; r != kNone; r = d.next_fixed[r]) {
        this->solve_fixed(before, operation, r, work, &work->free);
        if constexpr (Motion::kHasRotation) changes.rotation = true;
      }
      if (!(body.shift == shift)) changes.shift = true;
    });
    switch (phase.stage()) {
      case BodyStage::none:
        break;
      case BodyStage::finish:
        d.step.solver[work->body] = body;
        d.step.orientation[work->body] = d.orientation[i];
        this->check_state(work->body);
        return;
      case BodyStage::move:
        this->move(work->body, i, phase.sweeps.moves(phase.sweep), work->orientation, &body);
        changes.shift = changes.rotation = true;
        break;
      case BodyStage::accelerate: {
        const Vec3 shift = body.shift;
        if (work->constants.has(soft_step::SubstepBody::kIsGyroscopic)) {
          work->orientation = d.orientation[i];
        }
        d.step.accelerate(work->body, work->constants, work->orientation, &body, &work->free.motion,
                          false);
        BodyMotion(d.columns, i).write_free(work->free.motion);
        if (!(body.shift == shift)) changes.shift = true;
        break;
      }
    }
    if constexpr (!Motion::kHasRotation) changes.rotation = false;
    motion.store_velocities(place, body);
    motion.store_shift(place, body);
    motion.store_rotation(place, body);
    motion.set_changes(place, changes);
  }
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
