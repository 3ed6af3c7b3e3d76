/// Solution of single rows of a soft step on a device, and the rows that exchange motion as cells.
#pragma once

#include "src/base/atomic.hpp"
#include "src/contact_solver/soft_step/row_operations.hpp"
#include "src/world/device/impacts.hpp"
#include "src/world/device/step_data.hpp"
#include "src/world/device/sweep.hpp"
#include "src/world/device/warp_items.hpp"

#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Solves the rows of the overflow, of colors and with fixed bodies. In a world of one block, rows
/// of colors exchange the motion of their bodies through BodyCells: a row waits only for the
/// earlier rows of its two bodies (see Tickets).
///
/// `a` and `b` of a row are places in a block (inner rows) or solver indices; `b` of a row with a
/// fixed body is that body, or kWorld.
/// @tparam kKinds number of kinds of rows that occur, which are the first ones: a program with
///   fewer kinds needs fewer registers
/// @tparam Cells access to the motion of a body: BodyCells, or BodyMotion in a world with blocks
template <soft_step::RowKind kKinds, class Cells>
struct RowSolver {
  using SolverBody = soft_step::SolverBody;

  StepData data;

  using Impact = typename ImpactOf<Cells>::Type;
  using BodyFree = device::BodyFree<Cells>;

  /// A body of an item: the ticket for which the item waits, and the motion of the body at that
  /// ticket.
  struct ItemBody {
    std::uint32_t index = kNone;          ///< solver index; kNone: the item has no body
    std::uint32_t before = 0, after = 0;  ///< tickets
    bool is_ready = false;
    SolverBody motion;
    typename Cells::Version version;

    template <bool kRotation>
    JFPX_HD void read(const StepData& step) {
      is_ready = Cells(step.columns, index).template read<kRotation>(before, &motion, &version);
    }
    JFPX_HD void start(std::uint32_t i, const StepData& step) {
      index = i;
      if constexpr (!Cells::kHasMasses) {
        const RowBody& constants = step.row_bodies[i];
        motion.inverse_mass = constants.inverse_mass;
        motion.inverse_inertia = constants.inverse_inertia;
      }
    }
  };

  /// A row that has a color, or that is solved before the colors.
  struct RowItem {
    std::uint32_t row = kNone;
    soft_step::RowKind kind = 0;
    ItemBody a, b;
    soft_step::SphereRow sphere;  ///< the row, if it is of this kind
  };

  // Items are constructed in place, bodies a and b are handled without a loop, and run() is
  // inlined. Otherwise nvcc spills items (6.6 kB per thread in double) or the sweep to memory.

  /// The rows of a sweep, for Team::run_dataflow().
  template <class Operation>
  class RowDataflow {
   public:
    using Item = RowItem;
    JFPX_HD RowDataflow(const RowSolver& solver, const Sweep& sweep, const Operation& operation,
                        const ColoredRows& rows)
        : solver_(solver), sweep_(sweep), operation_(operation), rows_(rows) {}

    JFPX_HD void begin(std::uint32_t i, RowItem* item) const {
      const auto [row, color] = rows_.find(i);
      if (row != kNone) solver_.begin_colored_row(sweep_, row, color, item);
    }
    JFPX_HD bool is_ready(RowItem* item) const { return solver_.is_ready(item); }
    JFPX_HD void complete(RowItem* item) const { solver_.solve_row(sweep_, operation_, item); }

   private:
    const RowSolver& solver_;
    const Sweep& sweep_;
    const Operation& operation_;
    const ColoredRows& rows_;
  };

  /// Solves the overflow rows one after the other: by kind, then in the order of their contacts.
  /// @param ticket of all bodies, which these rows do not change
  template <class Operation>
  JFPX_HD void run_overflow(const Sweep& sweep, const Operation& operation,
                            std::uint32_t ticket) const {
    const std::uint32_t rows = sweep.overflow();
    for (std::uint32_t k = 0; k < rows; ++k) {
      RowItem item;
      begin_row(sweep, data.overflow[k], &item);
      item.a.before = item.a.after = item.b.before = item.b.after = ticket;
      read_bodies(&item);
      solve_row(sweep, operation, &item);
    }
  }

  template <class F>
  JFPX_HD static decltype(auto) visit_row(soft_step::RowKind kind, const F& f) {
    return soft_step::visit_row<0, kKinds>(kind, f);
  }

  /// Initializes a row without its tickets.
  JFPX_HD void begin_row(const Sweep& sweep, std::uint32_t r, RowItem* item) const {
    const StepData& d = data;
    item->row = r;
    item->kind = sweep.kind_of(r);
    std::uint32_t a = 0, b = 0;
    visit_row(item->kind, [&](auto type) {
      using Row = typename decltype(type)::type;
      if constexpr (std::is_same_v<Row, soft_step::SphereRow>) {
        item->sphere = d.sphere_rows.load(r);
        a = item->sphere.a, b = item->sphere.b;
      } else {
        const Row& row = d.rows<Row>()[r - sweep.first<Row>()];
        a = row.a, b = row.b;
      }
    });
    item->a.start(a, d);
    item->b.start(b, d);
  }

  /// begin_row() for a row of spheres that is already loaded.
  JFPX_HD void begin_row(std::uint32_t r, const soft_step::SphereRow& row, RowItem* item) const {
    item->row = r;
    item->kind = soft_step::kKindOf<soft_step::SphereRow>;
    item->sphere = row;
    item->a.start(row.a, data);
    item->b.start(row.b, data);
  }

  JFPX_HD void begin_colored_row(const Sweep& sweep, std::uint32_t r, std::uint32_t color,
                                 RowItem* item) const {
    begin_row(sweep, r, item);
    const auto set_tickets = [&](ItemBody* body) {
      const Tickets tickets(sweep.number, data.row_bodies[body->index].colors);
      body->before = tickets.before(color);
      body->after = tickets.after(color);
    };
    set_tickets(&item->a);
    set_tickets(&item->b);
  }

  JFPX_HD bool is_ready(RowItem* item) const {
    if (item->row == kNone) return true;
    read_bodies(item);
    return item->a.is_ready && item->b.is_ready;
  }

  /// Reads the motion of the bodies of a row that is not yet known to be ready.
  JFPX_HD void read_bodies(RowItem* item) const {
    const auto read = [&](ItemBody* body) {
      if (body->is_ready) return;
      visit_row(item->kind, [&](auto type) {
        body->template read<decltype(type)::type::kReadsRotation>(data);
      });
    };
    read(&item->a);
    read(&item->b);
  }

  template <class Operation>
  JFPX_HD void solve_row(const Sweep& sweep, const Operation& operation, RowItem* item) const {
    if (item->row == kNone) return;
    visit_row(item->kind, [&](auto type) {
      using Row = typename decltype(type)::type;
      if constexpr (std::is_same_v<Row, soft_step::SphereRow>) {
        solve_spheres(operation, item);
      } else {
        solve_other<Row>(sweep, operation, item);
      }
    });
  }

  template <class Operation>
  JFPX_HD void solve_spheres(const Operation& operation, RowItem* item) const {
    soft_step::SphereRow& row = item->sphere;
    const Real restitution = row.restitution;
    const Vec3 shift_a = item->a.motion.shift, shift_b = item->b.motion.shift;
    const Impact impact({data.substep_bodies, 0}, data.columns, row.a);
    const soft_step::BodyPair pair{&item->a.motion, &item->b.motion, nullptr, nullptr};
    operation.template run<false>(
        &row, soft_step::RowContext<soft_step::NoPart, Impact>{pair, nullptr, &impact});
    const auto write = [&](ItemBody* body, const Vec3& shift) {
      const Cells cells(data.columns, body->index);
      if constexpr (Operation::kMovesBodies) {
        if (!(body->motion.shift == shift)) cells.write_shift(body->motion, &body->version);
        impact.write(body->index, cells, &body->version);
      }
      cells.write(body->after, body->motion, body->version);
    };
    write(&item->a, shift_a);
    write(&item->b, shift_b);
    if constexpr (Operation::kChangesRow) store_sphere_row(row, restitution, item->row);
  }

  template <class Row, class Operation>
  JFPX_HD void solve_other(const Sweep& sweep, const Operation& operation, RowItem* item) const {
    // Changed in place: a copy would be on the stack of the thread.
    Row& row = data.rows<Row>()[item->row - sweep.first<Row>()];
    const Mat3* inertia = data.step.bodies.inverse_inertia;
    const std::uint32_t a = data.body_of(item->a.index), b = data.body_of(item->b.index);
    auto context = context_of(
        row, soft_step::BodyPair{&item->a.motion, &item->b.motion, &inertia[a], &inertia[b]});
    Quat orientation_a, orientation_b;
    if constexpr (Row::kReadsOrientation) {
      orientation_a = data.orientation_cells[a].load(sweep.moves());
      orientation_b = data.orientation_cells[b].load(sweep.moves());
      const Quat* start = data.step.bodies.orientation;
      context.orientations = {&orientation_a, &orientation_b, &start[a], &start[b]};
    }
    operation.template run<false>(&row, context);
    const auto write = [&](ItemBody* body) {
      const Cells cells(data.columns, body->index);
      if constexpr (Operation::kMovesBodies) {
        cells.write_shift(body->motion, &body->version);
        if constexpr (Row::kReadsRotation) cells.write_rotation(body->motion, &body->version);
      }
      cells.write(body->after, body->motion, body->version);
    };
    write(&item->a);
    write(&item->b);
  }

  /// For a row that does not rebound in the sweeps.
  template <class Row>
  JFPX_HD soft_step::RowContext<typename Row::Part, soft_step::ImpactBodies> context_of(
      const Row& row, const soft_step::BodyPair& pair) const {
    return {pair, data.parts_of(row), nullptr};
  }

  /// Ends a substep of a movable body.
  /// @param index solver index of the body
  /// @param moves number of moves in the step, with this one
  /// @param orientation before the move
  JFPX_HD void move(std::uint32_t body, std::uint32_t index, std::uint32_t moves, Quat orientation,
                    SolverBody* motion) const {
    const StepData& d = data;
    bool has_joints = false;
    if constexpr (kKinds > soft_step::kContactRowKinds) {
      has_joints = d.substep_bodies.load(index).has(soft_step::SubstepBody::kHasJoints);
    }
    d.step.move(body, has_joints, &orientation, motion);
    d.orientation[index] = orientation;
    if (has_joints) d.orientation_cells[body].store(orientation, moves);
  }

  JFPX_HD void finish_kinematic(std::uint32_t i) const {
    const StepData& d = data;
    if (!d.step.bodies.is_carrier(i)) return;
    SolverBody body = fixed_body(i, 0);
    for (std::uint32_t k = 0; k < d.substeps; ++k) {
      d.step.move(i, d.world_joints.count > 0 && d.step.constrained[i] >= soft_step::kHasJoint,
                  &d.step.orientation[i], &body);
    }
    d.step.solver[i].shift = body.shift;
    d.step.solver[i].rotation = body.rotation;
    check_state(i);
  }

  /// Cancels the step if a body has left the world.
  JFPX_HD void check_state(std::uint32_t i) const {
    if (!is_in_world(data.step.state(i))) atomic_min(&data.counters->runaway, i);
  }

  /// State of an immovable or kinematic body after a number of moves. Each row that reads a
  /// kinematic body computes its motion, so no row waits for the body.
  JFPX_HD SolverBody fixed_body(std::uint32_t i, std::uint32_t moves) const {
    SolverBody body;
    body.velocity = data.step.solver[i].velocity;
    body.angular_velocity = data.step.solver[i].angular_velocity;
    if (data.step.bodies.awake[i] == 0) return body;
    const soft_step::FreeMotion pose = data.step.motion_of_pose(i, body);
    for (std::uint32_t k = 0; k < moves; ++k) {
      body.shift = add_scaled(body.shift, pose.velocity, data.step.h);
      body.rotation = add_scaled(body.rotation, pose.angular_velocity, data.step.h);
    }
    return body;
  }

  /// Orientation of an immovable or kinematic body after a number of moves.
  JFPX_HD Quat fixed_orientation(std::uint32_t i, std::uint32_t moves) const {
    const StepData& d = data;
    Quat orientation = d.step.bodies.orientation[i];
    if (d.step.bodies.awake[i] == 0) return orientation;
    const soft_step::FreeMotion pose = d.step.motion_of_pose(i, d.step.solver[i]);
    for (std::uint32_t k = 0; k < moves; ++k) {
      orientation = d.step.turned(orientation, pose.angular_velocity);
    }
    return orientation;
  }

  /// Solves a row of a movable body with a fixed one.
  template <class Operation>
  JFPX_HD void solve_fixed(const Sweep& sweep, const Operation& operation, std::uint32_t r,
                           ItemBody* item, BodyFree* free) const {
    visit_row(sweep.kind_of(r), [&](auto type) {
      using Row = typename decltype(type)::type;
      if constexpr (std::is_same_v<Row, soft_step::SphereRow>) {
        solve_fixed_spheres(operation, r, item, free);
      } else {
        solve_fixed_other<Row>(sweep, operation, r, item);
      }
    });
  }

  template <class Operation>
  JFPX_HD void solve_fixed_spheres(const Operation& operation, std::uint32_t r, ItemBody* item,
                                   BodyFree* free) const {
    soft_step::SphereRow row = data.sphere_rows.load(r);
    const Real restitution = row.restitution;
    SolverBody fixed;  // not read: the body is constant
    const Impact impact({data.substep_bodies, 0}, data.columns, row.a);
    const soft_step::BodyPair pair{&item->motion, &fixed, nullptr, nullptr};
    operation.template run<true>(
        &row, soft_step::RowContext<soft_step::NoPart, Impact>{pair, nullptr, &impact});
    impact.change(free, Cells(data.columns, item->index), item->version);
    if constexpr (Operation::kChangesRow) store_sphere_row(row, restitution, r);
  }

  template <class Row, class Operation>
  JFPX_HD void solve_fixed_other(const Sweep& sweep, const Operation& operation, std::uint32_t r,
                                 ItemBody* item) const {
    Row& row = data.rows<Row>()[r - sweep.first<Row>()];
    SolverBody fixed;
    const std::uint32_t body = data.body_of(row.a);
    const Mat3* inertia = data.step.bodies.inverse_inertia + body;
    auto context = context_of(row, soft_step::BodyPair{&item->motion, &fixed, inertia, nullptr});
    Quat orientation_a, orientation_b;
    if constexpr (Row::kReadsOrientation) {
      orientation_a = data.orientation[row.a];
      context.orientations = {&orientation_a, &orientation_b, &data.step.bodies.orientation[body],
                              nullptr};
    }
    if (!Row::kReadsOrientation || row.b != soft_step::kWorld) {
      fixed = fixed_body(row.b, sweep.moves());
      if constexpr (Row::kReadsOrientation) orientation_b = fixed_orientation(row.b, sweep.moves());
    }
    operation.template run<true>(&row, context);
  }

  /// Stores the changes of a row by an operation.
  /// @param restitution before the operation
  JFPX_HD void store_sphere_row(const soft_step::SphereRow& row, Real restitution,
                                std::uint32_t r) const {
    using Row = soft_step::SphereRow;
    data.sphere_rows.store_bytes<0, offsetof(Row, normal)>(r, row);
    if (restitution != row.restitution) {
      data.sphere_rows.store_bytes<offsetof(Row, restitution), offsetof(Row, a)>(r, row);
    }
  }
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
