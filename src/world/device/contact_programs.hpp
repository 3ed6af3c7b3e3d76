/// Contact search of a soft step on a device.
#pragma once

#include "src/world/device/atomic.hpp"
#include "src/world/device/sorted_range.hpp"
#include "src/world/device/step_data.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Starts the step: the bounds of the motion of all sub-shapes.
struct BoundsProgram {
  StepData data;

  template <class Team>
  JFPX_HD void operator()(const Team& team) const {
    const StepData& d = data;
    const BodyView& bodies = d.step.bodies;
    team.once([&] { *d.counters = Counters{}; });
    team.for_each(bodies.count, [&](std::uint32_t i) {
      const std::uint32_t body = bodies.ids[i].index;
      d.motion[body] = bodies.predicted_motion(body);
      if (bodies.movable(body) && bodies.awake[body] == 0) d.counters->any_asleep = 1;
    });
    team.for_each(d.near.sub_shapes.bounded_count, [&](std::uint32_t i) {
      d.near.sub_shapes.update_pose(bodies, i);
      d.near.sweep(i);
    });
  }
};

/// Makes the contact set of the pairs of swept bounds, and of all pairs with fixed sub-shapes.
struct ContactProgram {
  StepData data;

  template <class Team>
  JFPX_HD void operator()(const Team& team) const {
    const StepData& d = data;
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
    find_spheres(team);
    find_candidates(team);
    team.once([&] {
      Counters& c = *d.counters;
      c.needed.spheres = c.spheres;
      c.needed.candidates = c.candidates;
      if (c.spheres > d.capacity.spheres || c.candidates > d.capacity.candidates) c.failed = 1;
    });
    if (d.counters->failed != 0) return;
    team.for_each(d.counters->candidates,
                  [&](std::uint32_t i) { NearPairTest(d.near, &d.tested[i])(d.candidates[i]); });
    add_touches(team);
    sort_manifolds(team);
    add_manifolds(team);
  }

 private:
  enum Kind : std::uint8_t { kIgnored, kSpheres, kSensor, kCandidate };

  JFPX_HD std::uint32_t pair_count() const {
    return static_cast<std::uint32_t>(data.pair_count->contacts);
  }

  template <class Team>
  JFPX_HD void find_spheres(const Team& team) const {
    const StepData& d = data;
    const BodyView& bodies = d.step.bodies;
    const SubShapeView& sub_shapes = d.near.sub_shapes;
    team.for_each(pair_count(), [&](std::uint32_t i) {
      const SpherePair pair = d.pairs[i];
      const PairKind kind = d.near.kind_of(pair.a, pair.b);
      Kind result = kind == PairKind::none ? kIgnored : kCandidate;
      if (kind == PairKind::spheres) {
        const bool any_sensor = bodies.sensor[sub_shapes.body(pair.a)] != 0 ||
                                bodies.sensor[sub_shapes.body(pair.b)] != 0;
        const detail::SpeculativeContact contact = d.near.test_spheres(pair.a, pair.b);
        result = !contact.found          ? kIgnored
                 : !any_sensor           ? kSpheres
                 : contact.distance <= 0 ? kSensor
                                         : kIgnored;
      }
      d.pair_kind[i] = result;
    });
    const std::uint32_t found = team.scan(
        pair_count(), [&](std::uint32_t i) { return d.pair_kind[i] == kSpheres ? 1u : 0u; },
        [&](std::uint32_t i, std::uint32_t place) {
          if (d.pair_kind[i] != kSpheres || place >= d.capacity.spheres) return;
          const SpherePair pair = d.pairs[i];
          const detail::SpeculativeContact contact = d.near.test_spheres(pair.a, pair.b);
          d.now.view.spheres[place] = {{sub_shapes.body(pair.a), sub_shapes.body(pair.b), 0, 0},
                                       contact.normal,
                                       contact.distance};
        });
    team.once([&] { d.counters->spheres = found; });
  }

  template <class Team>
  JFPX_HD void find_candidates(const Team& team) const {
    const StepData& d = data;
    const BodyView& bodies = d.step.bodies;
    const SubShapeView& sub_shapes = d.near.sub_shapes;
    const std::uint32_t of_pairs = team.scan(
        pair_count(), [&](std::uint32_t i) { return d.pair_kind[i] == kCandidate ? 1u : 0u; },
        [&](std::uint32_t i, std::uint32_t place) {
          if (d.pair_kind[i] != kCandidate || place >= d.capacity.candidates) return;
          d.candidates[place] = ordered(bodies, sub_shapes, d.pairs[i].a, d.pairs[i].b);
        });
    const auto for_each_met = [&](std::uint32_t i, const auto& visit) {
      const std::uint32_t body = sub_shapes.body(i);
      if (!bodies.movable(body)) return;
      for (std::uint32_t fixed = sub_shapes.fixed_begin; fixed < sub_shapes.count; ++fixed) {
        if (bodies.may_collide(body, sub_shapes.body(fixed)) && d.near.may_meet(i, fixed)) {
          visit(fixed);
        }
      }
    };
    const std::uint32_t of_fixed = sub_shapes.fixed_begin == sub_shapes.count
                                       ? 0
                                       : team.scan(
                                             sub_shapes.fixed_begin,
                                             [&](std::uint32_t i) {
                                               std::uint32_t count = 0;
                                               for_each_met(i, [&](std::uint32_t) { ++count; });
                                               return count;
                                             },
                                             [&](std::uint32_t i, std::uint32_t before) {
                                               std::uint32_t place = of_pairs + before;
                                               for_each_met(i, [&](std::uint32_t fixed) {
                                                 if (place < d.capacity.candidates) {
                                                   d.candidates[place] =
                                                       ordered(bodies, sub_shapes, i, fixed);
                                                 }
                                                 ++place;
                                               });
                                             });
    team.once([&] { d.counters->candidates = of_pairs + of_fixed; });
  }

  /// Lists the points of World::contacts(), except contacts of two spheres.
  template <class Team>
  JFPX_HD void add_touches(const Team& team) const {
    const StepData& d = data;
    const SubShapeView& sub_shapes = d.near.sub_shapes;
    const std::uint32_t of_candidates = team.scan(
        d.counters->candidates, [&](std::uint32_t i) { return d.tested[i].touch_count; },
        [&](std::uint32_t i, std::uint32_t place) {
          const NearPair& near = d.tested[i];
          const Candidate& pair = d.candidates[i];
          const bool of_spheres = sub_shapes.is_sphere(pair.sub_shape_a) &&
                                  !sub_shapes.is_wall(pair.sub_shape_b) &&
                                  sub_shapes.is_sphere(pair.sub_shape_b);
          for (std::uint32_t k = 0; k < near.touch_count; ++k, ++place) {
            if (place >= d.capacity.touches) return;
            d.touches[place] = {pair,
                                k,
                                of_spheres ? 1u : 0u,
                                near.normal,
                                near.touches[k].point,
                                near.touches[k].distance};
          }
        });
    const std::uint32_t of_sensors = team.scan(
        pair_count(), [&](std::uint32_t i) { return d.pair_kind[i] == kSensor ? 1u : 0u; },
        [&](std::uint32_t i, std::uint32_t before) {
          const std::uint32_t place = of_candidates + before;
          if (d.pair_kind[i] != kSensor || place >= d.capacity.touches) return;
          const std::uint32_t a = d.pairs[i].a, b = d.pairs[i].b;
          const detail::SpeculativeContact contact = d.near.test_spheres(a, b);
          d.touches[place] = {{sub_shapes.body(a), sub_shapes.body(b), a, b},
                              0,
                              1,
                              contact.normal,
                              middle_point(contact.normal, contact.distance, sub_shapes.bounds(b)),
                              contact.distance};
        });
    const std::uint32_t stored =
        of_candidates < d.capacity.touches ? of_candidates : d.capacity.touches;
    const std::uint32_t of_spheres =
        team.count(stored, [&](std::uint32_t i) { return d.touches[i].of_spheres != 0; });
    team.once([&] {
      Counters& c = *d.counters;
      c.sphere_touches = of_spheres + of_sensors;
      c.touches = c.needed.touches = of_candidates + of_sensors;
      if (c.touches > d.capacity.touches) c.failed = 1;
    });
  }

  /// Fills `order` with the candidates that have points, sorted by key.
  template <class Team>
  JFPX_HD void sort_manifolds(const Team& team) const {
    const StepData& d = data;
    Range* ranges = d.now.manifolds_of;
    const std::uint32_t bodies = d.step.bodies.capacity;
    team.for_each(bodies, [&](std::uint32_t i) { ranges[i] = {}; });
    team.for_each(d.counters->candidates, [&](std::uint32_t i) {
      if (d.tested[i].point_count > 0) atomic_add(&ranges[d.tested[i].key.a].end, 1);
    });
    const std::uint32_t manifolds = team.scan(
        bodies, [&](std::uint32_t i) { return ranges[i].end - ranges[i].begin; },
        [&](std::uint32_t i, std::uint32_t before) {
          d.bucket[i].begin = d.bucket[i].end = before;
        });
    team.for_each(d.counters->candidates, [&](std::uint32_t i) {
      if (d.tested[i].point_count == 0) return;
      d.order[atomic_add(&d.bucket[d.tested[i].key.a].end, 1)] = i;
    });
    team.for_each(bodies, [&](std::uint32_t i) {
      const Range range = d.bucket[i];
      ranges[i] = range;
      sort_range(d.order + range.begin, range.end - range.begin,
                 [&](std::uint32_t x, std::uint32_t y) {
                   const soft_step::ContactKey &p = d.tested[x].key, &q = d.tested[y].key;
                   if (p.b != q.b) return p.b < q.b;
                   if (p.part_a != q.part_a) return p.part_a < q.part_a;
                   return p.part_b < q.part_b;
                 });
    });
    team.once([&] { d.counters->manifolds = manifolds; });
  }

  template <class Team>
  JFPX_HD void add_manifolds(const Team& team) const {
    const StepData& d = data;
    const std::uint32_t points = team.scan(
        d.counters->manifolds, [&](std::uint32_t m) { return d.tested[d.order[m]].point_count; },
        [&](std::uint32_t m, std::uint32_t first) {
          const NearPair& near = d.tested[d.order[m]];
          d.now.view.manifolds[m] = {near.key, near.normal, first, near.point_count, 0, 0};
          for (std::uint32_t k = 0; k < near.point_count; ++k) {
            if (first + k < d.capacity.points) d.now.view.points[first + k] = near.points[k];
          }
        });
    team.once([&] {
      Counters& c = *d.counters;
      c.points = c.needed.points = points;
      if (points > d.capacity.points) c.failed = 1;
    });
  }
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
