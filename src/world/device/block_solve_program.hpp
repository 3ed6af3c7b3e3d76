/// Substeps and restitution of a soft step on a device, for worlds that are divided into blocks.
#pragma once

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
  static constexpr unsigned kBlocksPerMultiprocessor = tuning::kSolve;
  static constexpr std::size_t kSharedBytes = Motion::kBytes;
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
      for_colors(begin, has_color, thread, count, sync, [&](std::uint32_t r, const auto& row) {
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

  /// Calls solve(r, row) for the rows of spheres of each color with the rows of a thread, and
  /// sync() after each color. A thread loads its next row before it solves a row.
  /// @param begin the first rows by color, and the end
  /// @param has_color whether a color is below the end of the colors
  template <class HasColor, class Sync, class Solve>
  [[gnu::always_inline]] JFPX_HD void for_colors(const std::uint32_t* begin,
                                                 const HasColor& has_color, std::uint32_t thread,
                                                 std::uint32_t count, const Sync& sync,
                                                 const Solve& solve) const {
    const std::uint32_t last = begin[soft_step::kColorsPerClass];
    soft_step::SphereRow ahead;
    std::uint32_t next = last;  // a part may have no rows of colors that other parts have
    const auto load = [&](std::uint32_t color, std::uint32_t row) {
      next = row;
      while (next >= begin[color + 1] && begin[color + 1] < last) {
        ++color;
        next = begin[color] + thread;
      }
      if (next < last) ahead = data.sphere_rows.load(next);
    };
    if (begin[0] < last) load(0, begin[0] + thread);
    for (std::uint32_t color = 0; has_color(color); ++color) {
      while (next < begin[color + 1]) {
        const soft_step::SphereRow row = ahead;
        const std::uint32_t r = next;
        load(color, r + count);
        solve(r, row);
      }
      sync();
    }
  }

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
    threads.for_each(
        count, [&](std::uint32_t i) { complete_body(before, phase, motion, i, places.begin + i); });
    if (has_inner) {
      constexpr std::uint32_t kEnds = soft_step::kColorsPerClass + 1u;
      threads.for_each(kKinds * kEnds, [&](std::uint32_t i) {
        const auto kind = static_cast<soft_step::RowKind>(i / kEnds);
        motion.row_begin(kind)[i % kEnds] = d.inner_begin(block, kind)[i % kEnds];
      });
    }
    if (phase.stage() == BodyStage::finish) return;
    threads.sync();
    if (has_inner) {
      visit_operation(phase.inner_sweep(), [&](const auto& operation) {
        solve_inner(threads, phase, operation, motion, places.begin);
      });
    }
    threads.for_each(count, [&](std::uint32_t i) { publish(motion, i, places.begin + i); });
  }

  /// Solves the inner rows of a block.
  template <class Threads, class Operation>
  [[gnu::always_inline]] JFPX_HD void solve_inner(const Threads& threads, const BlockPhase& phase,
                                                  const Operation& operation, const Motion& motion,
                                                  std::uint32_t first_place) const {
    if constexpr (kKinds == kSphereRowKinds) {
      solve_inner_spheres(threads, phase, operation, motion, first_place);
    } else {
      solve_inner_kinds(threads, phase, operation, motion, first_place);
    }
  }

  /// solve_inner() for rows of several kinds.
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

  /// solve_inner() if all rows are of spheres.
  template <class Threads, class Operation>
  [[gnu::always_inline]] JFPX_HD void solve_inner_spheres(const Threads& threads,
                                                          const BlockPhase& phase,
                                                          const Operation& operation,
                                                          const Motion& motion,
                                                          std::uint32_t first_place) const {
    const std::uint32_t* const begin = motion.row_begin(0);
    const auto has_color = [&](std::uint32_t color) {
      return begin[color] < begin[soft_step::kColorsPerClass];
    };
    threads.for_each_thread([&](std::uint32_t thread, std::uint32_t count, const auto& sync) {
      for_colors(begin, has_color, thread, count, sync, [&](std::uint32_t r, const auto& row) {
        solve_inner_row(phase, operation, motion, first_place, r, row);
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
    const Impact impact{{d.substep_bodies, first_place}, row.a};
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
    const auto write = [&](std::uint32_t i, const SolverBody& body, const Vec3& shift,
                           const soft_step::FreeMotion& change) {
      motion.store_velocities(i, body);
      if constexpr (Operation::kMovesBodies) {
        const bool moves = !(body.shift == shift);
        if (!moves && !Row::kReadsRotation && !impact.is_pending) return;
        typename Motion::Changes changes = motion.changes(i);
        if (moves) {
          motion.store_shift(i, body);
          changes.shift = true;
        }
        if constexpr (Row::kReadsRotation) {
          motion.store_rotation(i, body);
          changes.rotation = true;
        }
        if (impact.is_pending) {
          const BodyMotion stored(d.columns, first_place + i);
          soft_step::FreeMotion free = stored.read_free({});
          free.add(change.velocity, change.angular_velocity);
          stored.write_free(free);
        }
        motion.set_changes(i, changes);
      }
    };
    write(row.a, a, shift_a, impact.of_a);
    write(row.b, b, shift_b, impact.of_b);
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

  /// Completes the sweep before, and puts the motion of the body into shared memory.
  /// @param place of the body in its block
  /// @param i     its solver index
  JFPX_HD void complete_body(const Sweep& before, const BlockPhase& phase, const Motion& motion,
                             std::uint32_t place, std::uint32_t i) const {
    const StepData& d = data;
    ItemBody item;
    item.index = i;
    item.template read<Motion::kHasRotation>(d);
    if (!(item.motion.inverse_mass > 0)) {
      motion.store_velocities(place, {});
      return;
    }
    typename Motion::Changes changes;
    const std::uint32_t first_fixed = d.first_fixed[i];
    SolverBody& body = item.motion;
    const BodyMotion stored(d.columns, i);
    BodyFree free;
    visit_operation(phase.fixed_sweep(), [&](const auto& operation) {
      const Vec3 shift = body.shift;
      for (std::uint32_t r = first_fixed; r != kNone; r = d.next_fixed[r]) {
        this->solve_fixed(before, operation, r, &item, &free);
        if constexpr (Motion::kHasRotation) changes.rotation = true;
      }
      if (!(body.shift == shift)) changes.shift = true;
    });
    switch (phase.stage()) {
      case BodyStage::none:
        break;
      case BodyStage::finish: {
        const std::uint32_t index = d.body_at[i];
        d.step.solver[index] = body;
        d.step.orientation[index] = d.orientation[i];
        this->check_state(index);
        return;
      }
      case BodyStage::move:
        this->move(d.body_at[i], i, phase.sweeps.moves(phase.sweep), &body);
        changes.shift = changes.rotation = true;
        break;
      case BodyStage::accelerate: {
        const Vec3 shift = body.shift;
        free.read(stored, item.version);
        d.step.accelerate(d.body_at[i], d.substep_bodies.load(i), d.orientation[i], &body,
                          &free.motion, false);
        free.is_changed = true;
        if (!(body.shift == shift)) changes.shift = true;
        break;
      }
    }
    if (free.is_changed) stored.write_free(free.motion);
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
