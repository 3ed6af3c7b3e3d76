/// Waking, rows and substeps of a soft step on a device.
#pragma once

#include "src/world/device/atomic.hpp"
#include "src/world/device/islands.hpp"
#include "src/world/device/sorted_range.hpp"
#include "src/world/device/step_data.hpp"
#include "src/world/met_contacts.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Wakes the islands that touch an awake body, starts the bodies, and assigns rows to contacts.
struct PrepareProgram {
  StepData data;

  template <class Team>
  JFPX_HD void operator()(const Team& team) const {
    if (data.has_failed()) return;
    const StepData& d = data;
    const BodyView& bodies = d.step.bodies;
    const soft_step::ContactView contacts = d.contacts();
    if (d.counters->any_asleep != 0) wake_touched(team);
    team.for_each(bodies.capacity, [&](std::uint32_t i) {
      d.near_flag[i] = 0;
      d.bucket[i] = {};
    });
    team.for_each(contacts.size(), [&](std::uint32_t i) {
      d.near_flag[contacts.key(i).a] = 1;
      d.near_flag[contacts.key(i).b] = 1;
    });
    team.for_each(bodies.count, [&](std::uint32_t i) { d.step.load(bodies.ids[i].index); });
    place_rows(team);
    sort_overflow(team);
    place_points(team);
    sort_fixed(team);
    fill_rows(team);
  }

 private:
  template <class Team>
  JFPX_HD void wake_touched(const Team& team) const {
    const StepData& d = data;
    const BodyView& bodies = d.step.bodies;
    find_islands(team, d, [&](const soft_step::ContactView& contacts, std::uint32_t i) {
      return soft_step::will_touch(bodies, contacts, i);
    });
    team.for_each(bodies.count, [&](std::uint32_t i) {
      const std::uint32_t body = bodies.ids[i].index;
      if (bodies.movable(body) && bodies.awake[body] != 0) d.marked[island_of(d, body)] = 1;
    });
    team.for_each(bodies.count, [&](std::uint32_t i) {
      const std::uint32_t body = bodies.ids[i].index;
      if (bodies.movable(body) && bodies.awake[body] == 0 && d.marked[island_of(d, body)] != 0) {
        d.step.motion.wake(bodies, body);
      }
    });
  }

  /// Assigns a row to each contact, sorted by bin.
  template <class Team>
  JFPX_HD void place_rows(const Team& team) const {
    const StepData& d = data;
    const soft_step::RowSetup setup = d.row_setup();
    team.partition(
        setup.contacts.size(), kBins, d.counters->bin_begin,
        [&](std::uint32_t i) {
          const soft_step::RowKind kind = setup.kind_of(i);
          if (kind == soft_step::RowKind::none) return kNone;
          const std::uint32_t group = setup.group_of(i);
          return kind == soft_step::RowKind::sphere ? group : soft_step::kGroups + group;
        },
        [&](std::uint32_t i, std::uint32_t row) { d.row_contact[row] = i; });
    team.once([&] {
      const std::uint32_t* begin = d.counters->bin_begin;
      for (std::uint32_t group = 1; group < soft_step::kFixedGroup; ++group) {
        const std::uint32_t manifolds = soft_step::kGroups + group;
        if (begin[group + 1] > begin[group] || begin[manifolds + 1] > begin[manifolds]) {
          d.counters->last_group = group;
        }
      }
    });
  }

  /// The rows without a color are solved in the order of their contacts.
  template <class Team>
  JFPX_HD void sort_overflow(const Team& team) const {
    const StepData& d = data;
    const std::uint32_t* begin = d.counters->bin_begin;
    if (begin[1] == begin[0] && begin[soft_step::kGroups + 1] == begin[soft_step::kGroups]) return;
    team.once([&] {
      const auto by_number = [](std::uint32_t x, std::uint32_t y) { return x < y; };
      for (const std::uint32_t bin : {0u, soft_step::kGroups}) {
        sort_range(d.row_contact + begin[bin], begin[bin + 1] - begin[bin], by_number);
      }
    });
  }

  template <class Team>
  JFPX_HD void place_points(const Team& team) const {
    const StepData& d = data;
    const soft_step::ContactView contacts = d.contacts();
    const std::uint32_t first_row = first_manifold();
    team.scan(
        row_count() - first_row,
        [&](std::uint32_t r) { return contacts.impulse_count(d.row_contact[first_row + r]); },
        [&](std::uint32_t r, std::uint32_t first) { d.manifold_rows[r].first = first; });
  }

  /// Lists the rows with fixed bodies by movable body, in the order of their contacts.
  template <class Team>
  JFPX_HD void sort_fixed(const Team& team) const {
    const StepData& d = data;
    const soft_step::RowSetup setup = d.row_setup();
    const std::uint32_t* begin = d.counters->bin_begin;
    constexpr std::uint32_t kSpheres = soft_step::kFixedGroup;
    constexpr std::uint32_t kManifolds = soft_step::kGroups + soft_step::kFixedGroup;
    const std::uint32_t spheres = begin[kSpheres + 1] - begin[kSpheres];
    const std::uint32_t all = spheres + (begin[kManifolds + 1] - begin[kManifolds]);
    if (all == 0) return;
    const auto row_of = [&](std::uint32_t k) {
      return k < spheres ? begin[kSpheres] + k : begin[kManifolds] + (k - spheres);
    };
    const auto body_of = [&](std::uint32_t k) {
      const soft_step::ContactKey& key = setup.contacts.key(d.row_contact[row_of(k)]);
      return setup.is_flipped(key) ? key.b : key.a;
    };
    const BodyView& bodies = d.step.bodies;
    team.for_each(all, [&](std::uint32_t k) { atomic_add(&d.bucket[body_of(k)].end, 1); });
    std::uint32_t* next = d.first_contact;  // unused after the coloring
    team.scan(
        bodies.capacity, [&](std::uint32_t i) { return d.bucket[i].end - d.bucket[i].begin; },
        [&](std::uint32_t i, std::uint32_t before) { next[i] = before; });
    team.for_each(all, [&](std::uint32_t k) {
      d.fixed[atomic_add(&next[body_of(k)], 1)] = {d.row_contact[row_of(k)], row_of(k)};
    });
    const std::uint32_t count = team.scan(
        bodies.capacity,
        [&](std::uint32_t i) { return d.bucket[i].end > d.bucket[i].begin ? 1u : 0u; },
        [&](std::uint32_t i, std::uint32_t place) {
          if (d.bucket[i].end > d.bucket[i].begin) d.fixed_bodies[place] = i;
        });
    team.for_each(count, [&](std::uint32_t k) {
      const std::uint32_t body = d.fixed_bodies[k];
      const std::uint32_t rows = d.bucket[body].end;
      d.bucket[body] = {next[body] - rows, next[body]};
      sort_range(d.fixed + d.bucket[body].begin, rows,
                 [](const FixedRow& x, const FixedRow& y) { return x.contact < y.contact; });
    });
    team.once([&] { d.counters->fixed_bodies = count; });
  }

  template <class Team>
  JFPX_HD void fill_rows(const Team& team) const {
    const StepData& d = data;
    const soft_step::RowSetup setup = d.row_setup();
    const std::uint32_t* begin = d.counters->bin_begin;
    const std::uint32_t manifolds = first_manifold();
    team.for_each(row_count(), [&](std::uint32_t r) {
      const std::uint32_t contact = d.row_contact[r];
      bool rebounds = false;
      if (r < manifolds) {
        soft_step::SphereRow row;
        r < begin[soft_step::kFixedGroup] ? setup.fill<false>(&row, contact)
                                          : setup.fill<true>(&row, contact);
        d.sphere_rows[r] = row;
      } else {
        soft_step::ManifoldRow* row = &d.manifold_rows[r - manifolds];
        soft_step::PointRow* points = d.point_rows + row->first;
        const bool has_color = r < begin[soft_step::kGroups + soft_step::kFixedGroup];
        has_color ? setup.fill<false>(row, points, contact)
                  : setup.fill<true>(row, points, contact);
        for (std::uint32_t p = 0; p < row->count; ++p) rebounds |= points[p].rebound < 0;
      }
      if (rebounds) d.counters->any_rebound = 1;
    });
  }

  JFPX_HD std::uint32_t row_count() const { return data.counters->bin_begin[kBins]; }
  JFPX_HD std::uint32_t first_manifold() const {
    return data.counters->bin_begin[soft_step::kGroups];
  }
};

/// The substeps and restitution.
struct SolveProgram {
  StepData data;

  template <class Team>
  JFPX_HD void operator()(const Team& team) const {
    if (data.has_failed()) return;
    const StepData& d = data;
    const BodyView& bodies = d.step.bodies;
    const Sweep sweep{team.cached_bins(d.counters->bin_begin), d.counters->last_group,
                      d.counters->fixed_bodies};
    for (std::uint32_t substep = 0; substep < d.substeps; ++substep) {
      team.for_each(bodies.count,
                    [&](std::uint32_t i) { d.step.accelerate(bodies.ids[i].index, substep == 0); });
      if (substep == 0) run(team, sweep, WarmStart{});
      run(team, sweep, Solve<true>{d.constants, d.step.impacts()});
      team.for_each(bodies.count, [&](std::uint32_t i) { d.step.move(bodies.ids[i].index); });
      run(team, sweep, Solve<false>{d.constants, d.step.impacts()});
    }
    if (d.counters->any_rebound != 0) run(team, sweep, Restitute{});
    const soft_step::RowSetup setup = d.row_setup();
    team.for_each(sweep.begin[kBins], [&](std::uint32_t r) {
      if (r < sweep.first_manifold()) {
        setup.store(d.sphere_rows[r], d.row_contact[r]);
      } else {
        const soft_step::ManifoldRow& row = d.manifold_rows[r - sweep.first_manifold()];
        setup.store(row, d.point_rows + row.first, d.row_contact[r]);
      }
    });
  }

 private:
  struct WarmStart {
    static constexpr bool kChangesRow = false, kMoves = false;
    template <bool kFixed>
    JFPX_HD void run(soft_step::SphereRow* row, soft_step::SolverBody* a,
                     soft_step::SolverBody* b) const {
      soft_step::warm_start<kFixed>(*row, a, b);
    }
    template <bool kFixed>
    JFPX_HD void run(soft_step::ManifoldRow* row, soft_step::PointRow* points,
                     const soft_step::BodyPair& pair) const {
      soft_step::warm_start<kFixed>(*row, points, pair);
    }
  };
  /// @tparam kSoft whether penetrations are pushed out
  template <bool kSoft>
  struct Solve {
    static constexpr bool kChangesRow = true, kMoves = true;
    const soft_step::StepConstants& constants;
    soft_step::ImpactBodies bodies;
    template <bool kFixed>
    JFPX_HD void run(soft_step::SphereRow* row, soft_step::SolverBody* a,
                     soft_step::SolverBody* b) const {
      soft_step::solve<kFixed>(row, a, b, constants, bodies, kSoft);
    }
    template <bool kFixed>
    JFPX_HD void run(soft_step::ManifoldRow* row, soft_step::PointRow* points,
                     const soft_step::BodyPair& pair) const {
      soft_step::solve<kFixed>(row, points, pair, constants, kSoft);
    }
  };
  struct Restitute {
    static constexpr bool kChangesRow = false, kMoves = false;
    /// Spheres have rebounded in the substeps.
    template <bool kFixed>
    JFPX_HD void run(soft_step::SphereRow*, soft_step::SolverBody*, soft_step::SolverBody*) const {}
    template <bool kFixed>
    JFPX_HD void run(soft_step::ManifoldRow* row, soft_step::PointRow* points,
                     const soft_step::BodyPair& pair) const {
      soft_step::restitute<kFixed>(*row, points, pair);
    }
  };

  /// Writes what an operation has changed of a body.
  /// @param shift that of the body before
  template <class Operation>
  JFPX_HD static void store(const soft_step::SolverBody& body, const Vec3& shift,
                            soft_step::SolverBody* to) {
    to->velocity = body.velocity;
    to->inverse_mass = body.inverse_mass;
    to->angular_velocity = body.angular_velocity;
    to->inverse_inertia = body.inverse_inertia;
    if constexpr (Operation::kMoves) {
      if (!(shift == body.shift)) to->shift = body.shift;
    }
  }

  /// The rows of the step.
  struct Sweep {
    const std::uint32_t* begin;  ///< Counters::bin_begin
    std::uint32_t last_group;
    std::uint32_t fixed_bodies;
    JFPX_HD std::uint32_t first_manifold() const { return begin[soft_step::kGroups]; }
    /// Number of rows of a group of either kind.
    JFPX_HD std::uint32_t spheres(std::uint32_t group) const {
      return begin[group + 1] - begin[group];
    }
    JFPX_HD std::uint32_t manifolds(std::uint32_t group) const {
      return spheres(soft_step::kGroups + group);
    }
  };

  /// @param row a copy of row r, because the compiler can't know that rows and bodies do not
  /// overlap
  template <bool kFixed, class Operation>
  JFPX_HD void run_row(const Operation& operation, std::uint32_t r,
                       soft_step::SphereRow row) const {
    soft_step::SphereRow* at = &data.sphere_rows[r];
    soft_step::SolverBody* bodies = data.step.solver;
    soft_step::SolverBody a = bodies[row.a], b = bodies[row.b];
    const Vec3 shift_a = a.shift, shift_b = b.shift;
    const Real restitution = row.restitution;
    operation.template run<kFixed>(&row, &a, &b);
    store<Operation>(a, shift_a, &bodies[row.a]);
    if constexpr (!kFixed) store<Operation>(b, shift_b, &bodies[row.b]);
    if constexpr (Operation::kChangesRow) {
      at->friction_impulse = row.friction_impulse;
      at->normal_impulse = row.normal_impulse;
      if (restitution != row.restitution) at->restitution = row.restitution;
    }
  }

  /// @param m index in manifold_rows
  template <bool kFixed, class Operation>
  JFPX_HD void run_manifold(const Operation& operation, std::uint32_t m) const {
    soft_step::ManifoldRow* row = &data.manifold_rows[m];
    soft_step::SolverBody* bodies = data.step.solver;
    const Mat3* inertia = data.step.bodies.inverse_inertia;
    operation.template run<kFixed>(
        row, data.point_rows + row->first,
        soft_step::BodyPair{&bodies[row->a], &bodies[row->b], &inertia[row->a], &inertia[row->b]});
  }

  /// @param r number of the row among the rows of both kinds
  template <bool kFixed, class Operation>
  JFPX_HD void run_any(const Sweep& sweep, const Operation& operation, std::uint32_t r) const {
    if (r < sweep.first_manifold()) {
      run_row<kFixed>(operation, r, data.sphere_rows[r]);
    } else {
      run_manifold<kFixed>(operation, r - sweep.first_manifold());
    }
  }

  /// All rows in the order of soft_step::SoftStepSolver.
  template <class Team, class Operation>
  JFPX_HD void run(const Team& team, const Sweep& sweep, const Operation& operation) const {
    const StepData& d = data;
    constexpr std::uint32_t kManifolds = soft_step::kGroups;
    if (sweep.spheres(0) + sweep.manifolds(0) > 0) {
      team.once([&] {
        for (const std::uint32_t bin : {0u, kManifolds}) {
          for (std::uint32_t r = sweep.begin[bin]; r < sweep.begin[bin + 1]; ++r) {
            run_any<false>(sweep, operation, r);
          }
        }
      });
    }
    run_colors(team, sweep, operation);
    if (sweep.fixed_bodies == 0) return;
    team.for_each(sweep.fixed_bodies, [&](std::uint32_t i) {
      const Range range = d.bucket[d.fixed_bodies[i]];
      for (std::uint32_t k = range.begin; k < range.end; ++k) {
        run_any<true>(sweep, operation, d.fixed[k].row);
      }
    });
  }

  /// A thread reads its first row of a color before the barrier, to hide the latency of the read:
  /// no other row changes it.
  template <class Team, class Operation>
  JFPX_HD void run_colors(const Team& team, const Sweep& sweep, const Operation& operation) const {
    const StepData& d = data;
    soft_step::SphereRow next;
    const auto read_ahead = [&](std::uint32_t group) {
      if (group <= sweep.last_group && team.first() < sweep.spheres(group)) {
        next = d.sphere_rows[sweep.begin[group] + team.first()];
      }
    };
    read_ahead(1);
    for (std::uint32_t group = 1; group <= sweep.last_group; ++group) {
      const std::uint32_t spheres = sweep.spheres(group), all = spheres + sweep.manifolds(group);
      const std::uint32_t first = sweep.begin[group];
      const std::uint32_t manifold =
          sweep.begin[soft_step::kGroups + group] - sweep.first_manifold();
      for (std::uint32_t i = team.first(); i < all; i += team.stride()) {
        if (i >= spheres) {
          run_manifold<false>(operation, manifold + (i - spheres));
        } else {
          run_row<false>(operation, first + i, i == team.first() ? next : d.sphere_rows[first + i]);
        }
      }
      read_ahead(group + 1);
      if (all > 0) team.sync();
    }
  }
};

/// Ends the step: moves the bodies, clears forces, and puts islands to sleep. Has no effect if a
/// body has run away.
struct CommitProgram {
  StepData data;

  template <class Team>
  JFPX_HD void operator()(const Team& team) const {
    if (data.has_failed()) return;
    const StepData& d = data;
    const BodyView& bodies = d.step.bodies;
    team.for_each(bodies.count, [&](std::uint32_t i) {
      const std::uint32_t body = bodies.ids[i].index;
      if (bodies.awake[body] == 0 || is_in_world(d.step.state(body))) return;
      atomic_min(&d.counters->runaway, body);
    });
    if (d.counters->runaway != kNone) return;
    team.for_each(bodies.count, [&](std::uint32_t i) {
      const std::uint32_t body = bodies.ids[i].index;
      d.position_before[body] = bodies.position[body];
      if (d.step.store(body)) d.counters->any_rests = 1;
    });
    if (d.counters->any_rests != 0) put_islands_to_sleep(team);
    const std::uint32_t awake = team.count(bodies.count, [&](std::uint32_t i) {
      const std::uint32_t body = bodies.ids[i].index;
      return bodies.movable(body) && bodies.awake[body] != 0;
    });
    const soft_step::ContactView contacts = d.contacts();
    team.for_each(contacts.manifold_count, [&](std::uint32_t m) {
      const std::uint32_t met = soft_step::count_met(contacts, contacts.sphere_count + m);
      if (met > 0) atomic_add(&d.counters->met_points, met);
    });
    const std::uint32_t touching = team.count(
        d.counters->spheres, [&](std::uint32_t i) { return soft_step::has_touched(contacts, i); });
    team.once([&] {
      d.counters->awake = awake;
      d.counters->touching_spheres = touching;
      d.counters->completed = d.number;
    });
  }

 private:
  template <class Team>
  JFPX_HD void put_islands_to_sleep(const Team& team) const {
    const StepData& d = data;
    const BodyView& bodies = d.step.bodies;
    find_islands(team, d, [](const soft_step::ContactView& contacts, std::uint32_t i) {
      return soft_step::has_touched(contacts, i);
    });
    const auto is_awake = [&](std::uint32_t body) {
      return bodies.movable(body) && bodies.awake[body] != 0;
    };
    team.for_each(bodies.count, [&](std::uint32_t i) {
      const std::uint32_t body = bodies.ids[i].index;
      if (is_awake(body) && !bodies.is_at_rest(body)) d.marked[island_of(d, body)] = 1;
    });
    team.for_each(bodies.count, [&](std::uint32_t i) {
      const std::uint32_t body = bodies.ids[i].index;
      if (is_awake(body) && d.marked[island_of(d, body)] == 0) d.step.motion.put_to_sleep(body);
    });
  }
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
