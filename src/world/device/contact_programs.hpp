/// Contact search of a soft step on a device.
#pragma once

#include "src/base/atomic.hpp"
#include "src/world/contacts/hidden_points.hpp"
#include "src/world/device/list.hpp"
#include "src/world/device/start_step.hpp"
#include "src/world/device/step_data.hpp"
#include "src/world/device/tuning.hpp"

#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Starts the step, unless a ForceProgram has started it, and computes the bounds of the motion of
/// all sub-shapes.
struct BoundsProgram {
  static constexpr unsigned kBlocksPerMultiprocessor = tuning::kBounds;
  StepData data;
  bool is_started = false;

  template <class Team>
  JFPX_HD void operator()(const Team& team) const {
    const StepData& d = data;
    if (d.is_skipped()) return;
    const BodyView& bodies = d.step.bodies;
    if (!is_started) start_counters(team, d);
    if (bodies.has_blocks) {  // a block of places may be incomplete
      const std::uint32_t blocks = (bodies.capacity + kBodiesPerBlock - 1) / kBodiesPerBlock;
      team.for_each_nowait(
          blocks * kBodiesPerBlock, [&](std::uint32_t i) { d.body_at[i] = kNone; },
          &d.divisions.places);
    }
    Range* const spheres_of = d.contacts_of[d.counters->progress.completed & 1].spheres_of;
    const auto start_body = [&](std::uint32_t i) {
      start(i);
      spheres_of[i] = {};
    };
    team.for_each(bodies.capacity, start_body, &d.divisions.slots);
    if (bodies.has_blocks && d.world_joints.count > 0) {
      team.for_each_nowait((bodies.capacity + kBodiesPerBlock - 1) / kBodiesPerBlock,
                           [&](std::uint32_t block) { d.first_inner_joint[block] = kNone; });
    }
    if (d.parts > 1) number_blocks(team);
    std::uint32_t places = 0;  // of this thread
    const auto put = [&](std::uint32_t i) {
      const std::uint32_t body = bodies.ids[i].index;
      if (bodies.is_asleep(body)) d.counters->any_asleep = 1;
      if (bodies.has_blocks && bodies.movable(body)) put_into_block(body, &places);
    };
    team.for_each_nowait(bodies.count, put, &d.divisions.bodies);
    if (places > 0) raise(&d.counters->blocks.places, places);
    const auto sweep = [&](std::uint32_t i) {
      d.swept_bounds.sub_shapes.update_pose(bodies, i);
      d.swept_bounds.sweep(i);
      if (d.parts > 1) d.searched[i] = d.swept_bounds.swept[i];
    };
    team.for_each_nowait(d.swept_bounds.sub_shapes.ranges.bounded(), sweep,
                         &d.divisions.sub_shapes);
    if (d.trees.kinematic.block_count > 0) refit(team, d.trees.kinematic);
  }

 private:
  /// Computes the bounds of the kinematic solids, level by level.
  template <class Team>
  JFPX_HD void refit(const Team& team, const BlockTreeView& tree) const {
    team.sync();
    const std::uint32_t first = data.swept_bounds.sub_shapes.ranges.fixed_begin();
    team.for_each(tree.leaf_blocks, [&](std::uint32_t leaf) {
      tree.refit_leaf(
          leaf, [&](std::uint32_t item) { return data.swept_bounds.tree_bounds(first + item); });
    });
    for (std::uint32_t begin = tree.leaf_blocks; begin < tree.block_count;) {
      const std::uint32_t end = tree.end_of_level(begin);
      team.for_each(end - begin, [&](std::uint32_t i) { tree.refit_inner(begin + i); });
      begin = end;
    }
  }

  /// Numbers the blocks of places by their first bodies. Arrays by body and arrays by solver index
  /// then have the same bodies in the same part, as far as bodies that are close to each other have
  /// close slots.
  template <class Team>
  JFPX_HD void number_blocks(const Team& team) const {
    const StepData& d = data;
    const BodyView& bodies = d.step.bodies;
    std::uint32_t places = 0;  // of this thread
    const auto note_place = [&](std::uint32_t i) {
      const std::uint32_t body = bodies.ids[i].index;
      if (!bodies.movable(body)) return;
      const std::uint32_t place = bodies.place[body];
      if (place == soft_step::kNoPlace) return;
      if (place >= places) places = place + 1;
      if (place % kBodiesPerBlock == 0) d.first_of_block[place / kBodiesPerBlock] = body;
    };
    team.for_each_nowait(bodies.count, note_place, &d.divisions.bodies);
    if (places > 0) raise(&d.counters->blocks.places, places);
    team.sync();
    const std::uint32_t blocks = d.counters->blocks.placed();
    constexpr std::uint32_t kThreads = 32;  // that count for one block
    team.for_each(blocks * kThreads, [&](std::uint32_t i) {
      const std::uint32_t block = i / kThreads, first = d.first_of_block[block];
      std::uint32_t number = 0;
      for (std::uint32_t other = i % kThreads; other < blocks; other += kThreads) {
        const std::uint32_t it = d.first_of_block[other];
        if (it < first || (it == first && other < block)) ++number;
      }
      if (number > 0) atomic_add(&d.block_number[block], number);
    });
  }

  /// @param places is raised to the end of the places of the body
  JFPX_HD void put_into_block(std::uint32_t body, std::uint32_t* places) const {
    const StepData& d = data;
    const std::uint32_t place = d.step.bodies.place[body];
    if (place == soft_step::kNoPlace) {
      d.unplaced[append(&d.counters->blocks.without_place)] = body;
    } else {
      std::uint32_t index = place;
      if (d.parts > 1) {
        index = d.block_number[place / kBodiesPerBlock] * kBodiesPerBlock + place % kBodiesPerBlock;
      }
      d.body_at[index] = body;
      d.solver_index[body] = index;
      if (place >= *places) *places = place + 1;
    }
  }

  JFPX_HD void start(std::uint32_t body) const {
    const StepData& d = data;
    if (!is_started) save(d, body);
    d.motion[body] = d.step.bodies.predicted_motion(body);
    d.first_candidate[body] = kNone;
    d.manifold_sizes[body] = 0;
    d.used_colors[body] = {};
    if (d.parts > 1 && body % kBodiesPerBlock == 0) {
      d.first_of_block[body / kBodiesPerBlock] = kNone;
      d.block_number[body / kBodiesPerBlock] = 0;
    }
    d.first_order[body] = ~std::uint64_t{0};
    d.first_contact[body] = kNone;
    d.constrained[body] = 0;
  }
};

/// Computes the contacts of two spheres from the pairs of swept bounds, and lists all other pairs.
struct SphereProgram {
  static constexpr unsigned kBlocksPerMultiprocessor = tuning::kSphere;
  StepData data;

  template <class Team>
  JFPX_HD void operator()(const Team& team) const {
    const StepData& d = data;
    if (d.has_failed()) return;
    if (d.pair_count->first_invalid != cuda::kNoSphere) {
      team.once([&] { d.counters->invalid_bounds = 1; });
      return;
    }
    if (d.pair_count->complete == 0) {
      team.once([&] {
        d.counters->failed = 1;
        d.counters->needed.pairs = d.pair_count->contacts;
        d.counters->pairs = static_cast<std::uint32_t>(d.pair_count->contacts);
      });
      return;
    }
    const SubShapeRanges& ranges = d.swept_bounds.sub_shapes.ranges;
    if (ranges.fixed_begin() < ranges.all()) {
      team.for_each_nowait(
          ranges.fixed_begin(), [&](std::uint32_t i) { find_fixed(i); }, &d.divisions.sub_shapes);
    }
    const auto pairs = static_cast<std::uint32_t>(d.pair_count->contacts);
    const std::uint32_t found = team.scan(
        pairs,
        [&](std::uint32_t i) {
          d.pair_found[i] = test(i) ? 1 : 0;
          return std::uint32_t{d.pair_found[i]};
        },
        [&](std::uint32_t i) { return std::uint32_t{d.pair_found[i]}; },
        [&](std::uint32_t i, std::uint32_t place) {
          if (d.pair_found[i] == 0 || place >= d.capacity.spheres) return;
          const std::uint32_t *bodies = d.swept_bounds.sub_shapes.bodies, a = bodies[d.pairs[i].a],
                              b = bodies[d.pairs[i].b];
          const NormalDistance result = d.pair_results[i];
          d.now().view.spheres[place] = {{a, b, 0, 0}, result.normal, result.distance};
        },
        &d.divisions.pairs);
    team.team_of_part().once([&] { d.state().now.spheres = found; });
    team.once([&] {
      Counters& c = *d.counters;
      c.pairs = pairs;
      c.spheres = c.needed.spheres = found;
      std::uint32_t all = 0, most = 0;
      for (std::uint32_t part = 0; part < d.parts; ++part) {
        const PartState& state = *d.states[part];
        const std::uint32_t of_part = state.flat_candidates + state.other_candidates;
        all += of_part;
        if (of_part > most) most = of_part;
        c.flat_candidates += state.flat_candidates;
      }
      c.candidates = c.needed.candidates = all;
      c.needed.candidates_of_part = most;
      if (found > d.capacity.spheres || all > d.capacity.candidates ||
          most > d.candidate_capacity()) {
        c.failed = 1;
      }
    });
  }

 private:
  JFPX_HD void add_candidate(std::uint32_t a, std::uint32_t b, std::uint32_t element = 0) const {
    const std::uint32_t capacity = data.candidate_capacity();
    const SubShapeView& sub_shapes = data.swept_bounds.sub_shapes;
    const bool is_flat = sub_shapes.has_flat_faces(a) && sub_shapes.has_flat_faces(b);
    PartState& state = data.state();
    const std::uint32_t number =
        append_to_one(&state.other_candidates, &state.flat_candidates, is_flat);
    if (number >= capacity) return;
    const std::uint32_t place =
        is_flat ? data.flat_candidate(number) : data.part * capacity + number;
    data.candidates[place] = ordered(data.step.bodies, sub_shapes, a, b, element);
  }

  /// Lists the solids of mass 0 and the walls that a sub-shape of a movable body may touch.
  JFPX_HD void find_fixed(std::uint32_t i) const {
    if (!data.step.bodies.movable(data.swept_bounds.sub_shapes.body(i))) return;
    data.swept_bounds.visit_fixed(i, data.trees, [&](std::uint32_t fixed, std::uint32_t element) {
      add_candidate(i, fixed, element);
    });
  }

  /// @returns whether the pair is a contact of two spheres
  JFPX_HD bool test(std::uint32_t i) const {
    const StepData& d = data;
    const SpherePair pair = d.pairs[i];
    const PairKind kind = d.swept_bounds.kind_of(pair.a, pair.b);
    if (kind == PairKind::none) return false;
    if (kind != PairKind::spheres) {
      add_candidate(pair.a, pair.b);
      return false;
    }
    const detail::SpeculativeContact contact = d.swept_bounds.test_spheres(pair.a, pair.b);
    if (!contact.found) return false;
    const std::uint8_t* sensor = d.step.bodies.sensor;
    const std::uint32_t* bodies = d.swept_bounds.sub_shapes.bodies;
    if (sensor[bodies[pair.a]] != 0 || sensor[bodies[pair.b]] != 0) {
      if (contact.distance <= 0) add_candidate(pair.a, pair.b);
      return false;
    }
    d.pair_results[i] = {contact.normal, contact.distance};
    return true;
  }
};

/// Computes the contacts of all other sub-shapes.
struct ShapeProgram {
  static constexpr unsigned kBlocksPerMultiprocessor = tuning::kShape;
  static constexpr std::size_t kThreadsPerItem = tuning::kThreadsPerItem;
  StepData data;

  template <class Team>
  JFPX_HD void operator()(const Team& team) const {
    if (data.has_failed()) return;
    const StepData& d = data;
    if (d.counters->candidates == 0) {
      team.for_each_nowait(
          d.step.bodies.capacity, [&](std::uint32_t i) { d.now().manifolds_of[i] = {}; },
          &d.divisions.slots);
      return;
    }
    test_candidates(team);
    team.sync();
    if (d.counters->any_hiding != 0) {
      const std::uint32_t begin = d.part * d.candidate_capacity();
      team.team_of_part().for_each_divergent(
          d.state().hiding, [&](std::uint32_t i) { hide_points(d.hiding[begin + i]); });
      team.sync();
    }
    const auto size = [&](std::uint32_t body) { return d.manifold_sizes[body]; };
    const Range slots = range_of_part(d.step.bodies.capacity, d.part, d.parts, &d.divisions.slots);
    std::uint32_t* const bodies_with_manifolds = d.parent + slots.begin;  // not in use now
    const auto place = [&](std::uint32_t body, std::uint64_t first) {
      const std::uint64_t of_body = d.manifold_sizes[body];
      const auto manifold = static_cast<std::uint32_t>(first >> 32);
      d.now().manifolds_of[body] = {manifold, manifold + static_cast<std::uint32_t>(of_body >> 32)};
      if (of_body == 0) return;
      d.manifold_sizes[body] = first;
      bodies_with_manifolds[append(&d.state().bodies_with_manifolds)] = body;
    };
    const std::uint64_t sizes =
        team.scan(d.step.bodies.capacity, size, size, place, &d.divisions.slots);
    // The bodies at a wall are close to each other, and so would be the work on them in the scan.
    team.team_of_part().for_each_divergent(d.state().bodies_with_manifolds, [&](std::uint32_t i) {
      const std::uint32_t body = bodies_with_manifolds[i];
      add_manifolds(body, d.manifold_sizes[body]);
    });
    team.team_of_part().once([&] {
      d.state().now.manifolds = static_cast<std::uint32_t>(sizes >> 32);
      d.state().now.points = static_cast<std::uint32_t>(sizes);
    });
    team.once([&] {
      Counters& c = *d.counters;
      c.manifolds = static_cast<std::uint32_t>(sizes >> 32);
      c.points = c.needed.points = static_cast<std::uint32_t>(sizes);
      c.needed.touches = c.touches;
      if (c.points > d.capacity.points || c.touches > d.capacity.touches) c.failed = 1;
    });
  }

 private:
  /// First recycles contacts, then tests all other candidates. In one pass, a warp would execute
  /// both, one after the other, for a few of its threads each.
  template <class Team>
  JFPX_HD void test_candidates(const Team& team) const {
    const StepData& d = data;
    const auto of_part = team.team_of_part();
    const std::uint32_t begin = d.part * d.candidate_capacity();
    if (d.counters->flat_candidates > 0) {
      of_part.for_each_divergent(d.state().flat_candidates, [&](std::uint32_t i) {
        const std::uint32_t candidate = d.flat_candidate(i);
        if (is_recycled(candidate)) {
          note(candidate);
        } else {
          d.full_tests[begin + append(&d.state().full_tests)] = candidate;
        }
      });
      team.sync();
    }
    const std::uint32_t others = d.state().other_candidates;
    of_part.for_each_divergent(others + d.state().full_tests, [&](std::uint32_t i) {
      const std::uint32_t candidate = i < others ? begin + i : d.full_tests[begin + i - others];
      test_fully(d.swept_bounds, d.candidates[candidate], &d.tested[candidate]);
      note(candidate);
    });
  }

  JFPX_HD bool is_recycled(std::uint32_t candidate) const {
    const soft_step::ContactView last = data.last_contacts();
    const auto find_last = [&](const soft_step::ContactKey& key) {
      const std::uint32_t before = data.find_last_manifold(key);
      return before == kNone ? nullptr : &last.manifolds[before];
    };
    return recycle_last(data.swept_bounds, data.candidates[candidate], last.points, find_last,
                        &data.tested[candidate]);
  }

  /// Notes the result of a test.
  JFPX_HD void note(std::uint32_t i) const {
    const StepData& d = data;
    const Candidate& pair = d.candidates[i];
    CandidateManifold* const found = &d.tested[i];
    if (found->touch_count > 0) add_touches(pair, *found);
    if (found->point_count == 0) return;
    found->hidden = 0;
    found->is_listed = may_hide(d.swept_bounds, pair) ? 1 : 0;
    if (found->is_listed != 0) {
      d.hiding[d.part * d.candidate_capacity() + append(&d.state().hiding)] = i;
      d.counters->any_hiding = 1;
      atomic_exchange(&d.first_contact[found->key.a], i);  // not in use now
    }
    prepend(&d.first_candidate[found->key.a], d.next_candidate, i);
    atomic_add(&d.manifold_sizes[found->key.a], std::uint64_t{1} << 32 | found->point_count);
  }

  JFPX_HD void add_touches(const Candidate& pair, const CandidateManifold& found) const {
    const StepData& d = data;
    const SubShapeView& sub_shapes = d.swept_bounds.sub_shapes;
    const bool of_spheres = sub_shapes.is_sphere(pair.sub_shape_a) &&
                            !sub_shapes.is_wall(pair.sub_shape_b) &&
                            sub_shapes.is_sphere(pair.sub_shape_b);
    const std::uint32_t first = append(&d.counters->touches, found.touch_count);
    if (of_spheres) atomic_add(&d.counters->sphere_touches, found.touch_count);
    Touch* const touches = d.now().touches;
    for (std::uint32_t k = 0; k < found.touch_count; ++k) {
      if (first + k >= d.capacity.touches) return;
      touches[first + k] = {pair,
                            k,
                            static_cast<std::uint16_t>(of_spheres ? 1 : 0),
                            0,
                            found.normal,
                            found.touches[k].point,
                            found.touches[k].distance};
    }
  }

  /// Removes the points of a body that other contacts hide, if a contact is that of
  /// `first_contact`.
  JFPX_HD void hide_points(std::uint32_t contact) const {
    const StepData& d = data;
    const std::uint32_t body = d.tested[contact].key.a;
    const auto next_that_hides = [&](std::uint32_t i) {
      while (i != kNone && d.tested[i].is_listed == 0) i = d.next_candidate[i];
      return i;
    };
    if (d.first_contact[body] != contact) return;
    d.first_contact[body] = kNone;
    const std::uint32_t first = next_that_hides(d.first_candidate[body]);
    const auto contact_of = [&](std::uint32_t i) {
      const CandidateManifold& found = d.tested[i];
      return SurfaceContact{&d.candidates[i], found.normal, found.points, found.point_count};
    };
    bool any = false;
    for (std::uint32_t i = first; i != kNone; i = next_that_hides(d.next_candidate[i])) {
      std::uint32_t hidden = 0;
      for (std::uint32_t k = first; k != kNone; k = next_that_hides(d.next_candidate[k])) {
        if (k != i) hidden |= hidden_points(d.swept_bounds, contact_of(i), contact_of(k));
      }
      d.tested[i].hidden = hidden;
      any |= hidden != 0;
    }
    if (any) remove_hidden(body);
  }

  JFPX_HD void remove_hidden(std::uint32_t body) const {
    const StepData& d = data;
    std::uint32_t* link = &d.first_candidate[body];
    std::uint64_t sizes = 0;
    while (*link != kNone) {
      const std::uint32_t i = *link;
      CandidateManifold& found = d.tested[i];
      if (found.hidden != 0) {
        found.point_count = remove_points(found.hidden, found.point_count, found.points);
        found.tested = {};  // a hidden point may be visible in the next step
      }
      if (found.point_count == 0) {
        *link = d.next_candidate[i];
      } else {
        sizes += std::uint64_t{1} << 32 | found.point_count;
        link = &d.next_candidate[i];
      }
    }
    d.manifold_sizes[body] = sizes;
  }

  /// Builds the manifolds of a body a, sorted by key. @param sizes exclusive prefix sum of sizes
  JFPX_HD void add_manifolds(std::uint32_t body, std::uint64_t sizes) const {
    const StepData& d = data;
    auto manifold = static_cast<std::uint32_t>(sizes >> 32);
    auto point = static_cast<std::uint32_t>(sizes);
    const std::uint32_t first =
        sort_list(d.first_candidate[body], d.next_candidate, [&](std::uint32_t x, std::uint32_t y) {
          const soft_step::ContactKey &p = d.tested[x].key, &q = d.tested[y].key;
          if (p.b != q.b) return p.b < q.b;
          if (p.part_a != q.part_a) return p.part_a < q.part_a;
          return p.part_b < q.part_b;
        });
    for (std::uint32_t i = first; i != kNone; i = d.next_candidate[i]) {
      const CandidateManifold& found = d.tested[i];
      d.now().view.manifolds[manifold++] = {found.key,         found.normal, point,
                                            found.point_count, {},           found.tested};
      for (std::uint32_t k = 0; k < found.point_count; ++k, ++point) {
        if (point >= d.capacity.points) continue;
        // Copies the members, because the padding of a point is not initialized.
        const soft_step::PointInput& p = found.points[k];
        d.now().view.points[point] = {p.arm_a, p.arm_b, p.distance, p.feature, p.tested_distance};
      }
    }
  }
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
