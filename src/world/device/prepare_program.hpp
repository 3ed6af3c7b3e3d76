/// Waking of bodies, and the rows of a soft step on a device.
#pragma once

#include "src/base/atomic.hpp"
#include "src/world/device/list.hpp"
#include "src/world/device/step_data.hpp"
#include "src/world/device/tuning.hpp"

#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// The stages between the contacts and the sweeps.
enum PrepareStage : unsigned {
  kPrepareBodies = 1,   ///< wakes islands that touch an awake body, and initializes the bodies
  kPlaceRows = 2,       ///< assigns rows to contacts and joints, except inner rows
  kBuildInnerRows = 4,  ///< assigns and builds the inner rows
  kBuildRows = 8,       ///< builds all other rows
  /// All stages of a world of one block, which has no inner rows.
  kPrepareOneBlock = kPrepareBodies | kPlaceRows | kBuildRows
};

/// Prepares the sweeps. In a world of one block, one program has all stages. In a world with
/// blocks, each stage is a program, which needs fewer registers: more threads wait for memory at
/// the same time.
/// @tparam kStages sum of PrepareStage
template <unsigned kStages>
struct PrepareProgram {
  static constexpr bool kHasBlocks = kStages != kPrepareOneBlock;
  static constexpr bool has(PrepareStage stage) { return (kStages & stage) != 0; }

  /// The inner rows of a block, in memory that its threads share.
  struct BlockRows {
    /// By kind and color: number of rows, then the next row.
    std::uint32_t next[soft_step::kRowKinds][soft_step::kColorsPerClass];
    std::uint32_t points;  ///< of manifolds: their number, then the next one
    bool has_room[soft_step::kRowKinds];
    // By place in the block.
    soft_step::RowSetup::SphereProperties spheres[kBodiesPerBlock];
    /// First contact of two spheres, and first manifold.
    std::uint32_t first_sphere[kBodiesPerBlock], first_manifold[kBodiesPerBlock];
    /// In the list of the contacts of all bodies: number of the first contact of a body, and the
    /// end of its contacts of two spheres.
    std::uint32_t begin[kBodiesPerBlock], end_of_spheres[kBodiesPerBlock];
    std::uint32_t contacts;  ///< size of this list
  };

  static constexpr unsigned kBlocksPerMultiprocessor = kStages == kPlaceRows ? tuning::kPlaceStage
                                                       : kStages == kBuildInnerRows
                                                           ? tuning::kInnerStage
                                                       : kHasBlocks ? tuning::kPrepareStage
                                                                    : tuning::kPrepare;
  static constexpr std::size_t kThreadsPerItem = tuning::kThreadsPerItem;
  static constexpr std::size_t kSharedBytes = has(kBuildInnerRows) ? sizeof(BlockRows)
                                              : has(kPlaceRows)    ? kBytesOfBins
                                                                   : 0;
  StepData data;

  template <class Team>
  JFPX_HD void operator()(const Team& team) const {
    if (data.has_failed()) return;
    if constexpr (has(kPrepareBodies)) {
      if (!prepare_bodies(team)) return;
    }
    if constexpr (has(kPlaceRows)) {
      place_rows(team);
      place_points(team);
    }
    if constexpr (has(kPlaceRows) && has(kBuildRows)) team.sync();
    if constexpr (has(kBuildInnerRows)) place_inner_rows(team);
    if constexpr (has(kBuildRows)) build_rows(team);
  }

 private:
  /// @returns false if the step fails
  template <class Team>
  JFPX_HD bool prepare_bodies(const Team& team) const {
    const StepData& d = data;
    const BodyView& bodies = d.step.bodies;
    if (d.counters->any_asleep != 0) d.islands().wake_touched(team);
    if constexpr (!kHasBlocks) {
      team.for_each(bodies.count, [&](std::uint32_t i) {
        const std::uint32_t body = bodies.ids[i].index;
        d.step.load(body);
        start(body, body);
      });
    } else {
      if (!has_indices(team)) return false;
      const BlockCounts blocks = d.counters->blocks;
      const std::uint32_t first = blocks.first_without_place();
      team.for_each_nowait(blocks.without_place, [&](std::uint32_t i) {
        d.body_at[first + i] = d.unplaced[i];
        d.solver_index[d.unplaced[i]] = first + i;
      });
      team.for_each(
          bodies.count, [&](std::uint32_t i) { d.step.load(bodies.ids[i].index); },
          &d.divisions.bodies);
      team.for_each_nowait(
          blocks.indices(), [&](std::uint32_t i) { start(d.body_at[i], i); }, &d.divisions.places);
    }
    return true;
  }

  /// Builds all rows except inner rows.
  template <class Team>
  JFPX_HD void build_rows(const Team& team) const {
    const StepData& d = data;
    if (!has_room(team)) return;
    sort_overflow(team);
    if constexpr (kHasBlocks) {
      team.for_each_nowait(
          d.counters->blocks.indices(), [&](std::uint32_t i) { sort_fixed(i); },
          &d.divisions.places);
    } else {
      const BodyView& bodies = d.step.bodies;
      team.for_each_nowait(bodies.count, [&](std::uint32_t i) { sort_fixed(bodies.ids[i].index); });
    }
    const RowBins& rows = d.bins[team.part()];
    team.team_of_part().for_each_divergent(rows.begin[kBins] - rows.begin[0], [&](std::uint32_t i) {
      fill_row(rows, rows.begin[0] + i);
    });
  }

  /// Initializes a body for the first substep.
  /// @param i     the body, or kNone
  /// @param index its solver index
  JFPX_HD void start(std::uint32_t i, std::uint32_t index) const {
    const StepData& d = data;
    const BodyView& bodies = d.step.bodies;
    d.first_fixed[index] = kNone;
    if (i == kNone || !bodies.is_active(i)) {
      d.row_bodies[index] = {};
      d.balls[index] = {};
      if constexpr (kHasBlocks) BodyMotion(d.columns, index).start({}, {});
      return;
    }
    soft_step::SolverBody body = d.step.solver[i];
    d.row_bodies[index] = {body.inverse_mass, body.inverse_inertia, 0};
    d.balls[index] = {bodies.radius[i], bodies.friction[i], bodies.restitution[i]};
    const soft_step::SubstepBody constants = d.step.substep_body(i);
    d.substep_bodies.store(index, constants);
    const Quat orientation = d.step.orientation[i];
    d.orientation[index] = orientation;
    soft_step::FreeMotion free;
    d.step.accelerate(i, constants, orientation, &body, &free, true);
    if constexpr (kHasBlocks) {
      BodyMotion(d.columns, index).start(body, free);
    } else {
      BodyCells(d.columns, index).start(body, free);
    }
    if (constants.has(soft_step::SubstepBody::kHasJoints)) {
      d.orientation_cells[i].store(orientation, 0);
    }
  }

  /// Assigns a row to each contact and joint, sorted by part and bin, except those with inner rows.
  template <class Team>
  JFPX_HD void place_rows(const Team& team) const {
    const StepData& d = data;
    const soft_step::RowSetup setup = d.row_setup();
    team.partition(
        {setup.contacts.sphere_count, setup.size() - setup.contacts.sphere_count,
         &d.divisions.spheres, &d.divisions.manifolds},
        d.row_places, d.states, d.bins, d.row_capacity,
        [&](std::uint32_t i) -> std::uint16_t {
          const std::uint32_t color = setup.color_of(i);
          const soft_step::RowKind kind = setup.kind_of(i);
          if (kind == soft_step::kNoRow) return RowPlace::kNone;
          if (kHasBlocks && soft_step::is_inner_color(color)) {
            if (setup.is_joint(i)) add_inner_joint(setup, i);
            return RowPlace::inner(kind, color);
          }
          return soft_step::bin_of(kind, soft_step::RowSetup::group_of(color));
        },
        [&](std::uint32_t i, std::uint16_t bin) -> std::uint32_t {
          const std::uint32_t group = bin % soft_step::kGroups;
          if (group == soft_step::kOverflowGroup) return 0;
          const soft_step::ContactKey key = setup.key(i);
          const std::uint32_t body =
              group == soft_step::kFixedGroup ? setup.movable_body(key) : key.a;
          return part_of(d.index_of(body) / kBodiesPerBlock, d.parts, d.divisions.blocks);
        },
        [&](std::uint32_t i, std::uint32_t row, std::uint16_t bin) {
          if (!has_memory(row)) return;
          d.row_contact[row] = i;
          const std::uint32_t group = bin % soft_step::kGroups;
          if (group == soft_step::kFixedGroup) {
            const std::uint32_t body = setup.movable_body(setup.key(i));
            prepend(&d.first_fixed[d.index_of(body)], d.next_fixed, row);
          } else if (group > 0 && !kHasBlocks) {  // for Tickets
            const soft_step::ContactKey key = setup.key(i);
            const std::uint64_t bit = std::uint64_t{1} << (group - 1);
            atomic_or(&d.row_bodies[d.index_of(key.a)].colors, bit);
            atomic_or(&d.row_bodies[d.index_of(key.b)].colors, bit);
          }
        });
    team.for_each_nowait(d.parts * kBins, [&](std::uint32_t i) { note_bin(i / kBins, i % kBins); });
  }

  /// Completes RowBins for a bin.
  JFPX_HD void note_bin(std::uint32_t part, std::uint32_t bin) const {
    const StepData& d = data;
    RowBins& bins = d.bins[part];
    const std::uint32_t group = bin % soft_step::kGroups;
    if (group == 0) {
      const auto kind = static_cast<soft_step::RowKind>(bin / soft_step::kGroups);
      bins.first[kind] = bins.begin[bin] - part * d.capacity_of(kind);
    }
    const std::uint32_t first_color = soft_step::group_of_crossing(0);
    if (group < first_color || group >= soft_step::kFixedGroup) return;
    if (bins.begin[bin] < bins.begin[bin + 1]) {
      raise(&d.counters->crossing_colors, group - first_color + 1);
    }
  }

  /// Whether a row has memory. If the rows of a part do not fit, they may be among those of the
  /// next part, or have no memory; has_room() then ends the step.
  JFPX_HD bool has_memory(std::uint32_t row) const { return row < data.parts * data.row_capacity; }

  /// Assigns points to the rows of manifolds, except inner rows.
  template <class Team>
  JFPX_HD void place_points(const Team& team) const {
    const StepData& d = data;
    std::uint32_t all_rows = 0;
    for (std::uint32_t part = 0; part < d.parts; ++part) all_rows += manifolds_of(part);
    if (all_rows == 0) return;
    const soft_step::ContactView contacts = d.contacts();
    const std::uint32_t part = team.part(), rows = manifolds_of(part);
    const std::uint32_t first_row = d.bins[part].begin[soft_step::bin_of(kManifold, 0)];
    const auto size = [&](std::uint32_t r) {
      const std::uint32_t row = first_row + r;
      return has_memory(row) ? contacts.impulse_count(d.row_contact[row]) : 0;
    };
    const std::uint32_t capacity = d.capacity.manifold_rows;
    const std::uint32_t points =
        team.team_of_part().scan(rows, size, size, [&](std::uint32_t r, std::uint32_t first) {
          if (r >= capacity) return;
          d.manifold_rows[part * capacity + r].first = part * d.capacity.row_points + first;
        });
    team.team_of_part().once([&] { d.state().points_of_rows = points; });
  }

  JFPX_HD void add_inner_joint(const soft_step::RowSetup& setup, std::uint32_t i) const {
    const StepData& d = data;
    const std::uint32_t block = d.index_of(setup.key(i).a) / kBodiesPerBlock;
    prepend(&d.first_inner_joint[block], d.next_inner_joint, setup.joint_of(i));
  }

  /// Assigns the inner rows of each block, sorted by kind and color, and builds them. They are at
  /// the end of the arrays of rows.
  template <class Team>
  JFPX_HD void place_inner_rows(const Team& team) const {
    const soft_step::RowSetup setup = data.row_setup();
    const BlockCounts blocks = data.counters->blocks;
    const std::uint32_t placed = blocks.placed();
    const auto place = [&](std::uint32_t block, const auto& threads) {
      if (block >= placed) return;  // all rows of the bodies are crossing rows
      auto* rows = static_cast<BlockRows*>(threads.shared(kSharedBytes));
      constexpr std::uint32_t kCells = soft_step::kRowKinds * soft_step::kColorsPerClass;
      threads.for_each(kCells, [&](std::uint32_t i) {
        rows->next[i / soft_step::kColorsPerClass][i % soft_step::kColorsPerClass] = 0;
      });
      threads.once([&] { rows->points = 0; });
      const std::uint32_t first_place = block * kBodiesPerBlock;
      threads.for_each(kBodiesPerBlock, [&](std::uint32_t i) {
        const std::uint32_t body = data.body_at[first_place + i];
        rows->spheres[i] = data.sphere(first_place + i);
        const Range spheres = body == kNone ? Range() : data.now().spheres_of[body];
        const Range manifolds = body == kNone ? Range() : data.now().manifolds_of[body];
        rows->first_sphere[i] = spheres.begin;
        rows->first_manifold[i] = manifolds.begin;
        rows->end_of_spheres[i] = spheres.end - spheres.begin;
        rows->begin[i] = rows->end_of_spheres[i] + (manifolds.end - manifolds.begin);
      });
      threads.sync();
      const std::uint32_t contacts = threads.scan(kBodiesPerBlock, rows->begin);
      threads.for_each(kBodiesPerBlock,
                       [&](std::uint32_t i) { rows->end_of_spheres[i] += rows->begin[i]; });
      threads.once([&] { rows->contacts = contacts; });
      threads.sync();
      for_inner_contacts(threads, setup, block, *rows,
                         [&](std::uint32_t i, soft_step::RowKind kind, std::uint32_t color) {
                           atomic_add(&rows->next[kind][color], 1);
                           if (kind == kManifold) {
                             atomic_add(&rows->points, setup.contacts.impulse_count(i));
                           }
                         });
      threads.sync();
      threads.for_each(soft_step::kRowKinds, [&](std::uint32_t kind) {
        allocate_inner_rows(block, static_cast<soft_step::RowKind>(kind), rows);
      });
      threads.sync();
      // Rows of spheres are built at once, in the order of their contacts. All other rows take
      // longer, and are divided evenly among the threads.
      for_inner_contacts(threads, setup, block, *rows,
                         [&](std::uint32_t i, soft_step::RowKind kind, std::uint32_t color) {
                           if (!rows->has_room[kind]) return;
                           const std::uint32_t row = atomic_add(&rows->next[kind][color], 1);
                           if (kind == kSphere) {
                             fill_inner<soft_step::SphereRow>(setup, rows, row, i);
                           } else {
                             contact_of_inner_row(kind, row) = i;
                           }
                         });
      threads.sync();
      fill_inner_rows(threads, setup, block, rows, soft_step::RowTypes());
    };
    team.for_blocks(blocks.all(), place, &data.divisions.blocks);
  }

  static constexpr soft_step::RowKind kSphere = soft_step::kKindOf<soft_step::SphereRow>;
  static constexpr soft_step::RowKind kManifold = soft_step::kKindOf<soft_step::ManifoldRow>;

  JFPX_HD void allocate_inner_rows(std::uint32_t block, soft_step::RowKind kind,
                                   BlockRows* rows) const {
    const StepData& d = data;
    PartState& state = d.state();
    std::uint32_t* const next = rows->next[kind];
    std::uint32_t count = 0;
    for (std::uint32_t color = 0; color < soft_step::kColorsPerClass; ++color) {
      count += next[color];
    }
    const std::uint32_t end = count + (count > 0 ? atomic_add(&state.inner_rows[kind], count) : 0);
    const std::uint32_t capacity = d.capacity_of(kind);
    rows->has_room[kind] = end <= capacity;
    if (kind == kManifold && count > 0) {
      const std::uint32_t points_end = rows->points + atomic_add(&state.inner_points, rows->points);
      if (points_end > d.capacity.row_points) rows->has_room[kind] = false;
      rows->points = (d.part + 1) * d.capacity.row_points - points_end;
    }
    std::uint32_t begin = (d.part + 1) * capacity - end;
    std::uint32_t* const begins = d.inner_begin(block, kind);
    for (std::uint32_t color = 0; color < soft_step::kColorsPerClass; ++color) {
      begins[color] = begin;
      const std::uint32_t size = next[color];
      next[color] = begin;
      begin += size;
    }
    begins[soft_step::kColorsPerClass] = begin;
  }

  /// Calls f(contact, kind, color) for the contacts and joints with inner rows in a block.
  /// Consecutive threads have consecutive contacts, so that they read whole sectors.
  template <class Threads, class F>
  JFPX_HD void for_inner_contacts(const Threads& threads, const soft_step::RowSetup& setup,
                                  std::uint32_t block, const BlockRows& rows, const F& f) const {
    const StepData& d = data;
    const auto visit = [&](std::uint32_t i) {
      const RowPlace place{d.row_places[i]};
      if (place.is_inner()) f(i, place.kind(), place.color());
    };
    threads.for_each(rows.contacts, [&](std::uint32_t k) {
      std::uint32_t body = 0;  // the last one whose contacts begin at or before k
      for (std::uint32_t step = kBodiesPerBlock / 2; step > 0; step /= 2) {
        if (rows.begin[body + step] <= k) body += step;
      }
      visit(k < rows.end_of_spheres[body]
                ? rows.first_sphere[body] + (k - rows.begin[body])
                : setup.contacts.sphere_count + rows.first_manifold[body] +
                      (k - rows.end_of_spheres[body]));
    });
    if (d.world_joints.count == 0) return;
    threads.once([&] {
      for (std::uint32_t joint = d.first_inner_joint[block]; joint != kNone;
           joint = d.next_inner_joint[joint]) {
        visit(setup.contacts.size() + joint);
      }
    });
  }

  /// The contact or joint of an inner row.
  JFPX_HD std::uint32_t& contact_of_inner_row(soft_step::RowKind kind, std::uint32_t row) const {
    return data.inner_contacts[kind][row];
  }

  /// Builds the inner rows of a block, except those of spheres.
  template <class Threads, class... Row>
  JFPX_HD void fill_inner_rows(const Threads& threads, const soft_step::RowSetup& setup,
                               std::uint32_t block, BlockRows* rows,
                               const std::tuple<Row...>&) const {
    const auto fill = [&](auto type) {
      using RowType = typename decltype(type)::type;
      constexpr soft_step::RowKind kKind = soft_step::kKindOf<RowType>;
      if constexpr (kKind != kSphere) {
        if (!rows->has_room[kKind]) return;
        const std::uint32_t* begin = data.inner_begin(block, kKind);
        const std::uint32_t first = begin[0], end = begin[soft_step::kColorsPerClass];
        threads.for_each(end - first, [&](std::uint32_t i) {
          fill_inner<RowType>(setup, rows, first + i, contact_of_inner_row(kKind, first + i));
        });
      }
    };
    (fill(std::type_identity<Row>()), ...);
  }

  template <class Row>
  JFPX_HD void fill_inner(const soft_step::RowSetup& setup, BlockRows* rows, std::uint32_t r,
                          std::uint32_t contact) const {
    const StepData& d = data;
    const auto place_in_block = [&](std::uint32_t body) {
      return d.step.bodies.place[body] % kBodiesPerBlock;
    };
    d.row_of[contact] = r;
    if constexpr (std::is_same_v<Row, soft_step::SphereRow>) {
      const soft_step::ContactKey& key = setup.contacts.key(contact);
      Row row;
      row.a = place_in_block(key.a);
      row.b = place_in_block(key.b);
      setup.template fill<false>(&row, contact, false, rows->spheres[row.a], rows->spheres[row.b]);
      d.sphere_rows.store(r, row);
    } else {
      Row& row = d.rows<Row>()[r];
      if constexpr (soft_step::kHasParts<Row>) {
        row.first = atomic_add(&rows->points, setup.contacts.impulse_count(contact));
      }
      typename Row::Part* parts = d.parts_of(row);
      setup.template fill<false>(&row, parts, contact);
      if constexpr (std::is_same_v<Row, soft_step::ManifoldRow>) {
        if (any_rebounds(row, parts)) d.counters->any_rebound = 1;
      }
      row.a = place_in_block(row.a);
      row.b = place_in_block(row.b);
    }
  }

  /// @returns whether all solver indices of a world with blocks fit into memory
  template <class Team>
  JFPX_HD bool has_indices(const Team& team) const {
    const StepData& d = data;
    const std::uint32_t indices = d.counters->blocks.indices();
    if (indices <= d.capacity.indices) return true;
    team.once([&] {
      d.counters->needed.indices = indices;
      d.counters->failed = 1;
    });
    return false;
  }

  /// @returns whether the rows of each part and their points fit into memory
  template <class Team>
  JFPX_HD bool has_room(const Team& team) const {
    const StepData& d = data;
    std::uint32_t all = 0, manifolds = 0, points = 0, rows = 0;
    for (std::uint32_t part = 0; part < d.parts; ++part) {
      const PartState& state = *d.states[part];
      const std::uint32_t* begin = d.bins[part].begin;
      const std::uint32_t of_part = manifolds_of(part) + state.inner_rows[kManifold];
      all += of_part;
      manifolds = larger(manifolds, of_part);
      points = larger(points, state.points_of_rows + state.inner_points);
      rows = larger(rows, begin[kBins] - begin[0] + state.inner_rows[kSphere]);
    }
    team.once([&] { d.counters->manifold_rows = all; });
    team.team_of_part().once([&] {
      RowBins& bins = d.bins[team.part()];
      bins.crossing_colors = d.counters->crossing_colors;
      bins.blocks = d.counters->blocks;
    });
    if (manifolds <= d.capacity.manifold_rows && points <= d.capacity.row_points &&
        rows <= d.row_capacity) {
      return true;
    }
    team.once([&] {
      Capacity& needed = d.counters->needed;
      needed.manifold_rows = manifolds;
      needed.row_points = points;
      needed.rows = rows;
      d.counters->failed = 1;
    });
    return false;
  }
  JFPX_HD static std::uint32_t larger(std::uint32_t a, std::uint32_t b) { return a > b ? a : b; }

  /// Sorts the overflow rows by kind, then by their contacts.
  template <class Team>
  JFPX_HD void sort_overflow(const Team& team) const {
    const StepData& d = data;
    const std::uint32_t* begin = d.bins->begin;  // of the first part
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

  /// Sorts the rows between a movable body and fixed bodies. @param index solver index
  JFPX_HD void sort_fixed(std::uint32_t index) const {
    const StepData& d = data;
    if (d.first_fixed[index] == kNone) return;
    const soft_step::RowSetup setup = d.row_setup();
    const auto order = [&](std::uint32_t row) { return setup.fixed_order(d.row_contact[row]); };
    d.first_fixed[index] =
        sort_list(d.first_fixed[index], d.next_fixed,
                  [&](std::uint32_t x, std::uint32_t y) { return order(x) < order(y); });
  }

  /// @param bins of the part of the row
  JFPX_HD void fill_row(const RowBins& bins, std::uint32_t r) const {
    soft_step::visit_row(soft_step::kind_of_row(bins.begin, r),
                         [&](auto type) { fill<typename decltype(type)::type>(bins, r); });
  }
  template <class Row>
  JFPX_HD void fill(const RowBins& bins, std::uint32_t r) const {
    const StepData& d = data;
    const soft_step::RowSetup setup = d.row_setup();
    const std::uint32_t contact = d.row_contact[r];
    constexpr soft_step::RowKind kKind = soft_step::kKindOf<Row>;
    const bool is_fixed = r >= bins.begin[soft_step::bin_of(kKind, soft_step::kFixedGroup)];
    const std::uint32_t number = r - bins.first[kKind];
    d.row_of[contact] = number;
    if constexpr (std::is_same_v<Row, soft_step::SphereRow>) {
      const soft_step::ContactKey& key = setup.contacts.key(contact);
      const bool flipped = setup.is_flipped(key);
      const std::uint32_t b = flipped ? key.a : key.b;
      Row row;
      row.a = d.index_of(flipped ? key.b : key.a);
      if (is_fixed) {
        row.b = b;
        setup.fill<true>(&row, contact, flipped, d.sphere(row.a), setup.sphere(b));
      } else {
        row.b = d.index_of(b);
        setup.fill<false>(&row, contact, flipped, d.sphere(row.a), d.sphere(row.b));
      }
      d.sphere_rows.store(number, row);
    } else {
      Row* row = &d.rows<Row>()[number];
      typename Row::Part* parts = d.parts_of(*row);
      is_fixed ? setup.fill<true>(row, parts, contact) : setup.fill<false>(row, parts, contact);
      if constexpr (std::is_same_v<Row, soft_step::ManifoldRow>) {
        if (any_rebounds(*row, parts)) d.counters->any_rebound = 1;
      }
      row->a = d.index_of(row->a);
      if (!is_fixed) row->b = d.index_of(row->b);
    }
  }

  /// Number of the rows of manifolds of a part, except inner rows.
  JFPX_HD std::uint32_t manifolds_of(std::uint32_t part) const {
    const std::uint32_t* begin = data.bins[part].begin;
    return begin[soft_step::bin_of(kManifold + 1u, 0)] - begin[soft_step::bin_of(kManifold, 0)];
  }
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
