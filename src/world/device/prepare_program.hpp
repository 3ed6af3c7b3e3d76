/// Waking and rows of a soft step on a device.
#pragma once

#include "src/world/device/atomic.hpp"
#include "src/world/device/islands.hpp"
#include "src/world/device/list.hpp"
#include "src/world/device/step_data.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Wakes the islands that touch an awake body, starts the bodies, and assigns rows to contacts.
struct PrepareProgram {
  static constexpr unsigned kBlocksPerMultiprocessor = 3;
  StepData data;

  template <class Team>
  JFPX_HD void operator()(const Team& team) const {
    if (data.has_failed()) return;
    const StepData& d = data;
    const BodyView& bodies = d.step.bodies;
    if (d.counters->any_asleep != 0) wake_touched(team);
    team.for_each(bodies.count, [&](std::uint32_t i) { start(bodies.ids[i].index); });
    place_rows(team);
    if (row_count() > first_manifold() && !place_points(team)) return;
    sort_overflow(team);
    team.spread(bodies.count, [&](std::uint32_t i) { sort_fixed(bodies.ids[i].index); });
    team.spread(row_count(), [&](std::uint32_t r) { fill_row(r); });
  }

 private:
  /// Starts the step and its first substep for a body.
  JFPX_HD void start(std::uint32_t i) const {
    const StepData& d = data;
    d.step.load(i);
    soft_step::SolverBody body = d.step.solver[i];
    d.row_bodies[i] = {body.inverse_mass, body.inverse_inertia, 0};
    d.first_fixed[i] = kNone;
    soft_step::FreeMotion free;
    d.step.accelerate(i, &body, &free, true);
    d.cells(i).start(body, free);
  }

  template <class Team>
  JFPX_HD void wake_touched(const Team& team) const {
    const StepData& d = data;
    const BodyView& bodies = d.step.bodies;
    find_islands(team, d, [&](const soft_step::ContactView& contacts, std::uint32_t i) {
      return soft_step::will_touch(bodies, contacts, i);
    });
    team.for_each(bodies.count, [&](std::uint32_t i) {
      const std::uint32_t body = bodies.ids[i].index;
      if (!bodies.is_active(body)) return;
      std::uint8_t& mark = d.marked[island_of(d, body)];
      if (mark == 0) mark = soft_step::kTouchesSlowBody;
    });
    team.for_each(bodies.count, [&](std::uint32_t i) {
      const std::uint32_t body = bodies.ids[i].index;
      if (bodies.is_active(body) && !bodies.is_slow(body)) {
        d.marked[island_of(d, body)] = soft_step::kTouchesFastBody;
      }
    });
    team.for_each(bodies.count, [&](std::uint32_t i) {
      const std::uint32_t body = bodies.ids[i].index;
      if (!bodies.is_asleep(body)) return;
      soft_step::wake_touched(bodies, d.step.motion, body, d.marked[island_of(d, body)]);
    });
  }

  /// Assigns a row to each contact, sorted by bin.
  template <class Team>
  JFPX_HD void place_rows(const Team& team) const {
    const StepData& d = data;
    const soft_step::RowSetup setup = d.row_setup();
    team.partition(
        setup.contacts.size(), d.row_bins, d.counters->bin_begin,
        [&](std::uint32_t i) -> std::uint8_t {
          const soft_step::RowKind kind = setup.kind_of(i);
          if (kind == soft_step::RowKind::none) return kNoBin;
          const std::uint32_t group = setup.group_of(i);
          return static_cast<std::uint8_t>(
              kind == soft_step::RowKind::sphere ? group : soft_step::kGroups + group);
        },
        [&](std::uint32_t i, std::uint32_t row, std::uint8_t bin) {
          d.row_contact[row] = i;
          const soft_step::ContactKey& key = setup.contacts.key(i);
          const std::uint32_t group = bin % soft_step::kGroups;
          if (group == soft_step::kFixedGroup) {
            const std::uint32_t body = setup.is_flipped(key) ? key.b : key.a;
            prepend(&d.first_fixed[body], d.next_fixed, row);
          } else if (group > 0) {
            const std::uint64_t bit = std::uint64_t{1} << (group - 1);
            atomic_or(&d.row_bodies[key.a].colors, bit);
            atomic_or(&d.row_bodies[key.b].colors, bit);
          }
        });
  }

  /// @returns whether there is room for the rows of manifolds and their points
  template <class Team>
  JFPX_HD bool place_points(const Team& team) const {
    const StepData& d = data;
    const soft_step::ContactView contacts = d.contacts();
    const std::uint32_t first_row = first_manifold(), rows = row_count() - first_row;
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

  /// Sorts the rows without a color by their contacts: those of spheres, then the manifolds.
  template <class Team>
  JFPX_HD void sort_overflow(const Team& team) const {
    const StepData& d = data;
    const std::uint32_t* begin = d.counters->bin_begin;
    std::uint32_t before = 0;
    for (const std::uint32_t bin :
         {soft_step::kOverflowGroup, soft_step::kGroups + soft_step::kOverflowGroup}) {
      const Range range{begin[bin], begin[bin + 1]};
      team.spread(range.end - range.begin, [&](std::uint32_t k) {
        const std::uint32_t row = range.begin + k;
        std::uint32_t rank = before;
        for (std::uint32_t r = range.begin; r < range.end; ++r) {
          if (d.row_contact[r] < d.row_contact[row]) ++rank;
        }
        d.overflow[rank] = row;
      });
      before = range.end - range.begin;
    }
  }

  /// The rows of a body with fixed bodies are solved in the order of their contacts.
  JFPX_HD void sort_fixed(std::uint32_t body) const {
    const StepData& d = data;
    d.first_fixed[body] = sort_list(
        d.first_fixed[body], d.next_fixed,
        [&](std::uint32_t x, std::uint32_t y) { return d.row_contact[x] < d.row_contact[y]; });
  }

  JFPX_HD void fill_row(std::uint32_t r) const {
    const StepData& d = data;
    const soft_step::RowSetup setup = d.row_setup();
    const std::uint32_t* begin = d.counters->bin_begin;
    const std::uint32_t contact = d.row_contact[r];
    bool rebounds = false;
    if (r < first_manifold()) {
      soft_step::SphereRow row;
      r < begin[soft_step::kFixedGroup] ? setup.fill<false>(&row, contact)
                                        : setup.fill<true>(&row, contact);
      d.sphere_rows.store(r, row);
    } else {
      soft_step::ManifoldRow* row = &d.manifold_rows[r - first_manifold()];
      soft_step::PointRow* points = d.point_rows + row->first;
      const bool has_color = r < begin[soft_step::kGroups + soft_step::kFixedGroup];
      has_color ? setup.fill<false>(row, points, contact) : setup.fill<true>(row, points, contact);
      for (std::uint32_t p = 0; p < row->count; ++p) rebounds |= points[p].rebound < 0;
    }
    if (rebounds) d.counters->any_rebound = 1;
  }

  JFPX_HD std::uint32_t row_count() const { return data.counters->bin_begin[kBins]; }
  JFPX_HD std::uint32_t first_manifold() const {
    return data.counters->bin_begin[soft_step::kGroups];
  }
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
