/// Contact search of a soft step on a device.
#pragma once

#include "src/base/atomic.hpp"
#include "src/world/device/list.hpp"
#include "src/world/device/start_step.hpp"
#include "src/world/device/step_data.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Starts the step, unless a ForceProgram has, and makes the bounds of the motion of all
/// sub-shapes.
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
    team.for_each(bodies.capacity, [&](std::uint32_t i) { start(i); });
    team.spread(bodies.count, [&](std::uint32_t i) {
      const std::uint32_t body = bodies.ids[i].index;
      if (bodies.is_asleep(body)) d.counters->any_asleep = 1;
    });
    team.spread(d.near.sub_shapes.ranges.bounded(), [&](std::uint32_t i) {
      d.near.sub_shapes.update_pose(bodies, i);
      d.near.sweep(i);
    });
    if (d.trees.kinematic.block_count > 0) refit(team, d.trees.kinematic);
  }

 private:
  /// Makes the bounds of the kinematic solids, level by level.
  template <class Team>
  JFPX_HD void refit(const Team& team, const BlockTreeView& tree) const {
    team.sync();
    const std::uint32_t first = data.near.sub_shapes.ranges.fixed_begin();
    team.for_each(tree.leaf_blocks, [&](std::uint32_t leaf) {
      tree.refit_leaf(leaf,
                      [&](std::uint32_t item) { return data.near.tree_bounds(first + item); });
    });
    for (std::uint32_t begin = tree.leaf_blocks; begin < tree.block_count;) {
      const std::uint32_t end = tree.end_of_level(begin);
      team.for_each(end - begin, [&](std::uint32_t i) { tree.refit_inner(begin + i); });
      begin = end;
    }
  }

  JFPX_HD void start(std::uint32_t body) const {
    const StepData& d = data;
    if (!is_started) save(d, body);
    d.motion[body] = d.step.bodies.predicted_motion(body);
    d.first_candidate[body] = kNone;
    d.manifold_sizes[body] = 0;
    d.used_colors[body] = 0;
    d.first_order[body] = ~std::uint64_t{0};
    d.first_contact[body] = kNone;
    d.near_flag[body] = 0;
    d.now().spheres_of[body] = {};
  }
};

/// Makes the contacts of two spheres from the pairs of swept bounds, and lists all other pairs.
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
      });
      return;
    }
    const SubShapeRanges& ranges = d.near.sub_shapes.ranges;
    if (ranges.fixed_begin() < ranges.all()) {
      team.spread(ranges.fixed_begin(), [&](std::uint32_t i) { find_fixed(i); });
    }
    const std::uint32_t found = team.scan(
        static_cast<std::uint32_t>(d.pair_count->contacts),
        [&](std::uint32_t i) {
          d.pair_found[i] = test(i) ? 1 : 0;
          return std::uint32_t{d.pair_found[i]};
        },
        [&](std::uint32_t i) { return std::uint32_t{d.pair_found[i]}; },
        [&](std::uint32_t i, std::uint32_t place) {
          if (d.pair_found[i] == 0 || place >= d.capacity.spheres) return;
          const std::uint32_t *bodies = d.near.sub_shapes.bodies, a = bodies[d.pairs[i].a],
                              b = bodies[d.pairs[i].b];
          const NormalDistance result = d.pair_results[i];
          d.now().view.spheres[place] = {{a, b, 0, 0}, result.normal, result.distance};
        });
    team.once([&] {
      Counters& c = *d.counters;
      c.spheres = c.needed.spheres = found;
      c.needed.candidates = c.candidates;
      if (found > d.capacity.spheres || c.candidates > d.capacity.candidates) c.failed = 1;
    });
  }

 private:
  JFPX_HD void add_candidate(std::uint32_t a, std::uint32_t b) const {
    const std::uint32_t place = atomic_add(&data.counters->candidates, 1);
    if (place >= data.capacity.candidates) return;
    data.candidates[place] = ordered(data.step.bodies, data.near.sub_shapes, a, b);
  }

  /// Lists the solids of mass 0 and the walls that a sub-shape of a movable body may meet.
  JFPX_HD void find_fixed(std::uint32_t i) const {
    if (!data.step.bodies.movable(data.near.sub_shapes.body(i))) return;
    data.near.visit_fixed(i, data.trees, [&](std::uint32_t fixed) { add_candidate(i, fixed); });
  }

  /// @returns whether the pair is a contact of two spheres
  JFPX_HD bool test(std::uint32_t i) const {
    const StepData& d = data;
    const SpherePair pair = d.pairs[i];
    const PairKind kind = d.near.kind_of(pair.a, pair.b);
    if (kind == PairKind::none) return false;
    if (kind != PairKind::spheres) {
      add_candidate(pair.a, pair.b);
      return false;
    }
    const detail::SpeculativeContact contact = d.near.test_spheres(pair.a, pair.b);
    if (!contact.found) return false;
    const std::uint8_t* sensor = d.step.bodies.sensor;
    const std::uint32_t* bodies = d.near.sub_shapes.bodies;
    if (sensor[bodies[pair.a]] != 0 || sensor[bodies[pair.b]] != 0) {
      if (contact.distance <= 0) add_candidate(pair.a, pair.b);
      return false;
    }
    d.pair_results[i] = {contact.normal, contact.distance};
    return true;
  }
};

/// Makes the contacts of all other sub-shapes.
struct ShapeProgram {
  static constexpr unsigned kBlocksPerMultiprocessor = tuning::kShape;
  StepData data;

  template <class Team>
  JFPX_HD void operator()(const Team& team) const {
    if (data.has_failed()) return;
    const StepData& d = data;
    if (d.counters->candidates == 0) {
      team.spread(d.step.bodies.capacity, [&](std::uint32_t i) { d.now().manifolds_of[i] = {}; });
      return;
    }
    team.for_each(d.counters->candidates, [&](std::uint32_t i) { test(i); });
    const auto size = [&](std::uint32_t body) { return d.manifold_sizes[body]; };
    const std::uint64_t sizes =
        team.scan(d.step.bodies.capacity, size, size,
                  [&](std::uint32_t body, std::uint64_t first) { add_manifolds(body, first); });
    team.once([&] {
      Counters& c = *d.counters;
      c.manifolds = static_cast<std::uint32_t>(sizes >> 32);
      c.points = c.needed.points = static_cast<std::uint32_t>(sizes);
      c.needed.touches = c.touches;
      if (c.points > d.capacity.points || c.touches > d.capacity.touches) c.failed = 1;
    });
  }

 private:
  JFPX_HD void test(std::uint32_t i) const {
    const StepData& d = data;
    const Candidate& pair = d.candidates[i];
    NearPair* near = &d.tested[i];
    test_near_pair(d.near, pair, near);
    if (near->touch_count > 0) add_touches(pair, *near);
    if (near->point_count == 0) return;
    prepend(&d.first_candidate[near->key.a], d.next_candidate, i);
    atomic_add(&d.manifold_sizes[near->key.a], std::uint64_t{1} << 32 | near->point_count);
  }

  JFPX_HD void add_touches(const Candidate& pair, const NearPair& near) const {
    const StepData& d = data;
    const SubShapeView& sub_shapes = d.near.sub_shapes;
    const bool of_spheres = sub_shapes.is_sphere(pair.sub_shape_a) &&
                            !sub_shapes.is_wall(pair.sub_shape_b) &&
                            sub_shapes.is_sphere(pair.sub_shape_b);
    const std::uint32_t first = atomic_add(&d.counters->touches, near.touch_count);
    if (of_spheres) atomic_add(&d.counters->sphere_touches, near.touch_count);
    Touch* const touches = d.now().touches;
    for (std::uint32_t k = 0; k < near.touch_count; ++k) {
      if (first + k >= d.capacity.touches) return;
      touches[first + k] = {pair,
                            k,
                            static_cast<std::uint16_t>(of_spheres ? 1 : 0),
                            0,
                            near.normal,
                            near.touches[k].point,
                            near.touches[k].distance};
    }
  }

  /// Makes the manifolds of a body a, sorted by key. @param sizes of the manifolds before
  JFPX_HD void add_manifolds(std::uint32_t body, std::uint64_t sizes) const {
    const StepData& d = data;
    auto manifold = static_cast<std::uint32_t>(sizes >> 32);
    auto point = static_cast<std::uint32_t>(sizes);
    Range& range = d.now().manifolds_of[body];
    range.begin = manifold;
    const std::uint32_t first =
        sort_list(d.first_candidate[body], d.next_candidate, [&](std::uint32_t x, std::uint32_t y) {
          const soft_step::ContactKey &p = d.tested[x].key, &q = d.tested[y].key;
          if (p.b != q.b) return p.b < q.b;
          if (p.part_a != q.part_a) return p.part_a < q.part_a;
          return p.part_b < q.part_b;
        });
    for (std::uint32_t i = first; i != kNone; i = d.next_candidate[i]) {
      const NearPair& near = d.tested[i];
      d.now().view.manifolds[manifold++] = {near.key, near.normal, point, near.point_count, 0, 0};
      for (std::uint32_t k = 0; k < near.point_count; ++k, ++point) {
        if (point >= d.capacity.points) continue;
        // Members, because the padding of a point is not initialized.
        const soft_step::PointInput& p = near.points[k];
        d.now().view.points[point] = {p.arm_a, p.arm_b, p.distance, p.feature};
      }
    }
    range.end = manifold;
  }
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
