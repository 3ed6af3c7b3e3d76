/// End of a soft step on a device.
#pragma once

#include "src/base/atomic.hpp"
#include "src/world/bodies/partition.hpp"
#include "src/world/contacts/begun_contacts.hpp"
#include "src/world/device/step_data.hpp"
#include "src/world/step/continuous_collision.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Ends the step: stores the impulses of the rows by contact, stops bodies at walls, moves the
/// bodies, clears forces, and puts islands to sleep. If the step cannot be completed or a body has
/// left the world, it only counts the step.
struct CommitProgram {
  static constexpr unsigned kBlocksPerMultiprocessor = tuning::kCommit;
  StepData data;

  template <class Team>
  JFPX_HD void operator()(const Team& team) const {
    const StepData& d = data;
    if (d.has_failed() || d.counters->runaway != kNone) {
      team.once([&] { ++d.counters->progress.deferred; });
      return;
    }
    const BodyView& bodies = d.step.bodies;
    const Progress& progress = d.counters->progress;
    const std::uint64_t steps = progress.offset + progress.completed;  // before complete()
    const soft_step::ContactView contacts = d.contacts();
    const soft_step::RowSetup setup = d.row_setup();
    team.count(
        contacts.sphere_count,
        [&](std::uint32_t i) {
          store_impulses(setup, i);
          return soft_step::has_touched(contacts, i);
        },
        &d.counters->touching_spheres, &d.divisions.spheres);
    const auto store_other = [&](std::uint32_t i) {
      store_impulses(setup, contacts.sphere_count + i);
    };
    team.for_each_nowait(setup.size() - contacts.sphere_count, store_other, &d.divisions.manifolds);
    ContinuousCollision{d.step, d.swept_bounds.sub_shapes, d.trees}.run(
        DividedTeam<Team>{team, d.divisions.sub_shapes}, bodies.count,
        [&](std::uint32_t i) { return bodies.ids[i].index; }, &d.counters->any_fast);
    const DeviceContacts& now = d.now();
    Vec3* const position_before = now.position_before;
    Vec3* const velocity_before = now.velocity_before;
    Vec3* const angular_velocity_before = now.angular_velocity_before;
    const auto store = [&](std::uint32_t i) {
      const std::uint32_t body = bodies.ids[i].index;
      position_before[body] = bodies.position[body];
      if (velocity_before != nullptr) {
        velocity_before[body] = bodies.velocity[body];
        angular_velocity_before[body] = bodies.angular_velocity[body];
      }
      if (d.step.store(body)) d.counters->any_rests = 1;
    };
    team.for_each(bodies.count, store, &d.divisions.bodies);
    if (d.counters->any_rests != 0) d.islands().put_to_sleep(team);
    team.count(
        bodies.count, [&](std::uint32_t i) { return bodies.is_active(bodies.ids[i].index); },
        &d.counters->awake, &d.divisions.bodies);
    const auto add_begun = [&](std::uint32_t m) {
      const std::uint32_t begun = soft_step::count_begun(contacts, contacts.sphere_count + m);
      if (begun > 0) atomic_add(&d.counters->begun_points, begun);
    };
    team.for_each_nowait(contacts.manifold_count, add_begun, &d.divisions.manifolds);
    if (bodies.has_blocks &&
        partition::is_due(steps, bodies.movable_count, d.counters->blocks.without_place)) {
      team.sync();
      if (d.counters->awake > 0) renew_partition(team);
    }
    team.once([&] { complete(); });
  }

 private:
  /// A team whose loops have the division of sub-shapes, also those over bodies: without compounds,
  /// their numbers differ little.
  template <class Team>
  struct DividedTeam {
    const Team& team;
    const Division& division;
    template <class F>
    JFPX_HD void for_each(std::uint32_t n, const F& f) const {
      team.for_each(n, f, &division);
    }
  };

  /// Stores the impulses of the row of a contact or joint.
  JFPX_HD void store_impulses(const soft_step::RowSetup& setup, std::uint32_t i) const {
    const RowPlace place{data.row_places[i]};
    if (!place.is_row()) return;
    soft_step::visit_row(place.kind(), [&](auto type) {
      const auto& row = data.row<typename decltype(type)::type>(data.row_of[i]);
      setup.store(row, data.parts_of(row), i);
    });
  }

  /// Device version of Partition::update().
  template <class Team>
  JFPX_HD void renew_partition(const Team& team) const {
    const StepData& d = data;
    const BodyView& bodies = d.step.bodies;
    const auto body = [&](std::uint32_t i) { return bodies.ids[i].index; };
    std::uint64_t largest = 0;  // of this thread
    team.for_each_nowait(bodies.count, [&](std::uint32_t i) {
      if (!bodies.movable(body(i))) return;
      const std::uint64_t magnitude = partition::magnitude_of(bodies.position[body(i)]);
      if (magnitude > largest) largest = magnitude;
    });
    if (largest > 0) raise(&d.counters->largest_coordinate, largest);
    team.sync();
    const partition::Grid grid(static_cast<partition::Magnitude>(d.counters->largest_coordinate));
    const SortedCodes& codes = d.codes;
    // Codes have 63 bits, so bodies of mass 0 are last.
    team.for_each(bodies.count, [&](std::uint32_t i) {
      const bool is_movable = bodies.movable(body(i));
      codes.keys[i] = is_movable ? grid.code(bodies.position[body(i)]) : ~std::uint64_t{0};
      codes.items[i] = body(i);
    });
    team.sort(bodies.count, codes);
    team.for_each_nowait(bodies.movable_count,
                         [&](std::uint32_t i) { d.step.motion.place[codes.items[i]] = i; });
  }

  JFPX_HD void complete() const {
    const Counters& c = *data.counters;
    Progress& progress = data.counters->progress;
    progress.contacts[progress.completed & 1] = {c.spheres, c.manifolds, c.points, c.touches};
    progress.started = 0;
    ++progress.completed;
  }
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
