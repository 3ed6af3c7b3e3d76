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

/// Makes the contacts of two spheres from the pairs of swept bounds.
struct SphereProgram {
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
    const auto pairs = static_cast<std::uint32_t>(d.pair_count->contacts);
    team.for_each(pairs, [&](std::uint32_t i) { test(i); });
    const std::uint32_t found = team.scan(
        pairs, [&](std::uint32_t i) { return d.pair_kind[i] == PairResultKind::spheres ? 1u : 0u; },
        [&](std::uint32_t i, std::uint32_t place) {
          if (d.pair_kind[i] != PairResultKind::spheres || place >= d.capacity.spheres) return;
          const std::uint32_t *bodies = d.near.sub_shapes.bodies, a = bodies[d.pairs[i].a],
                              b = bodies[d.pairs[i].b];
          const NormalDistance result = d.pair_results[i];
          d.now.view.spheres[place] = {{a, b, 0, 0}, result.normal, result.distance};
        });
    team.once([&] {
      Counters& c = *d.counters;
      c.spheres = c.needed.spheres = found;
      if (found > d.capacity.spheres) c.failed = 1;
    });
  }

 private:
  JFPX_HD void test(std::uint32_t i) const {
    const StepData& d = data;
    const SpherePair pair = d.pairs[i];
    const PairKind kind = d.near.kind_of(pair.a, pair.b);
    PairResultKind result =
        kind == PairKind::none ? PairResultKind::ignored : PairResultKind::candidate;
    if (kind == PairKind::spheres) {
      const std::uint8_t* sensor = d.step.bodies.sensor;
      const std::uint32_t* bodies = d.near.sub_shapes.bodies;
      const bool any_sensor = sensor[bodies[pair.a]] != 0 || sensor[bodies[pair.b]] != 0;
      const detail::SpeculativeContact contact = d.near.test_spheres(pair.a, pair.b);
      if (!contact.found || (any_sensor && !(contact.distance <= 0))) {
        result = PairResultKind::ignored;
      } else {
        result = any_sensor ? PairResultKind::sensor : PairResultKind::spheres;
        d.pair_results[i] = {contact.normal, contact.distance};
      }
    }
    d.pair_kind[i] = result;
    if (result == PairResultKind::candidate) d.counters->any_candidate_pair = 1;
    if (result == PairResultKind::sensor) d.counters->any_sensor_pair = 1;
  }
};

/// Makes the contacts of all other sub-shapes.
struct ShapeProgram {
  StepData data;

  template <class Team>
  JFPX_HD void operator()(const Team& team) const {
    if (data.has_failed()) return;
    const StepData& d = data;
    find_candidates(team);
    if (d.counters->failed != 0) return;
    team.for_each(d.counters->candidates,
                  [&](std::uint32_t i) { NearPairTest(d.near, &d.tested[i])(d.candidates[i]); });
    add_touches(team);
    sort_manifolds(team);
    add_manifolds(team);
  }

 private:
  JFPX_HD std::uint32_t pair_count() const {
    return static_cast<std::uint32_t>(data.pair_count->contacts);
  }

  template <class Team>
  JFPX_HD void find_candidates(const Team& team) const {
    const StepData& d = data;
    const BodyView& bodies = d.step.bodies;
    const SubShapeView& sub_shapes = d.near.sub_shapes;
    const auto is_candidate = [&](std::uint32_t i) {
      return d.pair_kind[i] == PairResultKind::candidate ? 1u : 0u;
    };
    const std::uint32_t of_pairs =
        team.scan(d.counters->any_candidate_pair != 0 ? pair_count() : 0, is_candidate,
                  [&](std::uint32_t i, std::uint32_t place) {
                    if (is_candidate(i) == 0 || place >= d.capacity.candidates) return;
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
    team.once([&] {
      Counters& c = *d.counters;
      c.candidates = c.needed.candidates = of_pairs + of_fixed;
      if (c.candidates > d.capacity.candidates) c.failed = 1;
    });
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
    const auto is_sensor = [&](std::uint32_t i) {
      return d.pair_kind[i] == PairResultKind::sensor ? 1u : 0u;
    };
    const std::uint32_t of_sensors = team.scan(
        d.counters->any_sensor_pair != 0 ? pair_count() : 0, is_sensor,
        [&](std::uint32_t i, std::uint32_t before) {
          const std::uint32_t place = of_candidates + before;
          if (is_sensor(i) == 0 || place >= d.capacity.touches) return;
          const std::uint32_t a = d.pairs[i].a, b = d.pairs[i].b;
          const NormalDistance result = d.pair_results[i];
          d.touches[place] = {{sub_shapes.body(a), sub_shapes.body(b), a, b},
                              0,
                              1,
                              result.normal,
                              middle_point(result.normal, result.distance, sub_shapes.bounds(b)),
                              result.distance};
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
            if (first + k >= d.capacity.points) return;
            // Members, because the padding of a point is not initialized.
            const soft_step::PointInput& p = near.points[k];
            d.now.view.points[first + k] = {p.arm_a, p.arm_b, p.distance, p.feature};
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
