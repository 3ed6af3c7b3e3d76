/// Waking of bodies and assignment of rows in a soft step on a device.
#pragma once

#include "src/base/atomic.hpp"
#include "src/world/device/list.hpp"
#include "src/world/device/step_data.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Wakes islands that touch an awake body, initializes the bodies, and assigns rows to contacts.
struct PrepareProgram {
  static constexpr unsigned kBlocksPerMultiprocessor = tuning::kPrepare;
  StepData data;

  template <class Team>
  JFPX_HD void operator()(const Team& team) const {
    if (data.has_failed()) return;
    const StepData& d = data;
    const BodyView& bodies = d.step.bodies;
    if (d.counters->any_asleep != 0) d.islands().wake_touched(team);
    team.for_each(bodies.count, [&](std::uint32_t i) { start(bodies.ids[i].index); });
    place_rows(team);
    if (size<soft_step::ManifoldRow>() > 0 && !place_points(team)) return;
    sort_overflow(team);
    team.for_each_nowait(bodies.count, [&](std::uint32_t i) { sort_fixed(bodies.ids[i].index); });
    team.for_each_nowait(row_count(), [&](std::uint32_t r) { fill_row(r); });
  }

 private:
  /// Initializes a body for the step and its first substep.
  JFPX_HD void start(std::uint32_t i) const {
    const StepData& d = data;
    d.step.load(i);
    soft_step::SolverBody body = d.step.solver[i];
    d.row_bodies[i] = {body.inverse_mass, body.inverse_inertia, 0};
    d.first_fixed[i] = kNone;
    soft_step::FreeMotion free;
    d.step.accelerate(i, &body, &free, true);
    d.cells(i).start(body, free);
    if (d.is_joined(i)) d.orientation_cells[i].store(d.step.orientation[i], 0);
  }

  /// Assigns a row to each contact and joint, sorted by bin.
  template <class Team>
  JFPX_HD void place_rows(const Team& team) const {
    const StepData& d = data;
    const soft_step::RowSetup setup = d.row_setup();
    team.partition(
        setup.size(), d.row_bins, d.counters->bin_begin,
        [&](std::uint32_t i) -> std::uint16_t {
          const soft_step::RowKind kind = setup.kind_of(i);
          return kind == soft_step::kNoRow ? soft_step::kNoBin
                                           : soft_step::bin_of(kind, setup.group_of(i));
        },
        [&](std::uint32_t i, std::uint32_t row, std::uint16_t bin) {
          d.row_contact[row] = i;
          const soft_step::ContactKey key = setup.key(i);
          const std::uint32_t group = bin % soft_step::kGroups;
          if (group == soft_step::kFixedGroup) {
            prepend(&d.first_fixed[setup.movable_body(key)], d.next_fixed, row);
          } else if (group > 0) {
            const std::uint64_t bit = std::uint64_t{1} << (group - 1);
            atomic_or(&d.row_bodies[key.a].colors, bit);
            atomic_or(&d.row_bodies[key.b].colors, bit);
          }
        });
  }

  /// @returns whether the rows of manifolds and their points fit into memory
  template <class Team>
  JFPX_HD bool place_points(const Team& team) const {
    const StepData& d = data;
    const soft_step::ContactView contacts = d.contacts();
    const std::uint32_t first_row = first<soft_step::ManifoldRow>();
    const std::uint32_t rows = size<soft_step::ManifoldRow>();
    const bool has_rows = rows <= d.capacity.manifold_rows;
    const auto size = [&](std::uint32_t r) {
      return contacts.impulse_count(d.row_contact[first_row + r]);
    };
    const std::uint32_t points =
        team.scan(rows, size, size, [&](std::uint32_t r, std::uint32_t first) {
          if (has_rows) d.manifold_rows[r].first = first;
        });
    if (has_rows && points <= d.capacity.row_points) return true;
    team.once([&] {
      d.counters->needed.manifold_rows = rows;
      d.counters->needed.row_points = points;
      d.counters->failed = 1;
    });
    return false;
  }

  /// Sorts the overflow rows by kind, then by their contacts.
  template <class Team>
  JFPX_HD void sort_overflow(const Team& team) const {
    const StepData& d = data;
    const std::uint32_t* begin = d.counters->bin_begin;
    std::uint32_t before = 0;
    for (std::uint32_t kind = 0; kind < soft_step::kRowKinds; ++kind) {
      const std::uint32_t bin = soft_step::bin_of(kind, soft_step::kOverflowGroup);
      const Range range{begin[bin], begin[bin + 1]};
      team.for_each_nowait(range.end - range.begin, [&](std::uint32_t k) {
        const std::uint32_t row = range.begin + k;
        std::uint32_t rank = before;
        for (std::uint32_t r = range.begin; r < range.end; ++r) {
          if (d.row_contact[r] < d.row_contact[row]) ++rank;
        }
        d.overflow[rank] = row;
      });
      before += range.end - range.begin;
    }
  }

  /// Sorts the rows between a movable body and fixed bodies.
  JFPX_HD void sort_fixed(std::uint32_t body) const {
    const StepData& d = data;
    const soft_step::RowSetup setup = d.row_setup();
    const auto order = [&](std::uint32_t row) { return setup.fixed_order(d.row_contact[row]); };
    d.first_fixed[body] =
        sort_list(d.first_fixed[body], d.next_fixed,
                  [&](std::uint32_t x, std::uint32_t y) { return order(x) < order(y); });
  }

  JFPX_HD void fill_row(std::uint32_t r) const {
    soft_step::visit_row(soft_step::kind_of_row(data.counters->bin_begin, r),
                         [&](auto type) { fill<typename decltype(type)::type>(r); });
  }
  template <class Row>
  JFPX_HD void fill(std::uint32_t r) const {
    const StepData& d = data;
    const soft_step::RowSetup setup = d.row_setup();
    const std::uint32_t contact = d.row_contact[r];
    constexpr soft_step::RowKind kKind = soft_step::kKindOf<Row>;
    const bool is_fixed =
        r >= d.counters->bin_begin[soft_step::bin_of(kKind, soft_step::kFixedGroup)];
    const auto fill_in = [&](Row* row) {
      typename Row::Part* parts = d.parts_of(*row);
      is_fixed ? setup.fill<true>(row, parts, contact) : setup.fill<false>(row, parts, contact);
    };
    if constexpr (std::is_same_v<Row, soft_step::SphereRow>) {
      Row row;
      fill_in(&row);
      d.sphere_rows.store(r, row);
    } else {
      Row* row = &d.rows<Row>()[r - first<Row>()];
      fill_in(row);
      if constexpr (std::is_same_v<Row, soft_step::ManifoldRow>) {
        if (any_rebounds(*row, d.parts_of(*row))) d.counters->any_rebound = 1;
      }
    }
  }

  JFPX_HD std::uint32_t row_count() const { return data.counters->bin_begin[kBins]; }
  /// First row of a kind.
  template <class Row>
  JFPX_HD std::uint32_t first() const {
    return data.counters->bin_begin[soft_step::bin_of(soft_step::kKindOf<Row>, 0)];
  }
  /// Number of rows of a kind.
  template <class Row>
  JFPX_HD std::uint32_t size() const {
    return data.counters->bin_begin[soft_step::bin_of(soft_step::kKindOf<Row> + 1u, 0)] -
           first<Row>();
  }
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
