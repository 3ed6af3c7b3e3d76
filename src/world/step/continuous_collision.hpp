/// Continuous collision: nothing passes a fixed body within a step.
///
/// Contacts are detected along the motion that is predicted at the start of a step. A body that is
/// hit during the step may leave this path, and a hard impact may press it deep into a contact. At
/// the end of the step, the core of a body that has moved far is swept against the walls and the
/// solids of mass 0, from the start of the step to its end, and the body is stopped where the core
/// touches (as the time of impact of Box2D, Catto 2013). The next step then has a contact.
///
/// The core of a solid is a ball about its centre with half its least half width. It never touches
/// in ordinary contacts, so that the pass changes nothing while contacts hold.
#pragma once

#include "src/base/atomic.hpp"
#include "src/collide/core_sweep.hpp"
#include "src/world/contacts/recycle.hpp"
#include "src/world/contacts/swept_bounds.hpp"
#include "src/world/step/soft_step_stages.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

/// The continuous collision of a step, after its substeps and before its end. For movable bodies
/// only; balls of mass 0 are not in the trees and do not stop anything.
struct ContinuousCollision {
  using SubShape = SubShapeView::SubShape;

  const soft_step::StepBodies& step;
  const SubShapeView& sub_shapes;  ///< with the poses at the start of the step
  const FixedTreesView& trees;     ///< with the motion of the step
  /// The sub-shapes of the bodies that are tested; null: all.
  const SubShape* tested = nullptr;
  std::uint32_t tested_count = 0;
  /// Keys of IgnoredPairs whose contacts are ignored in the step, sorted.
  const std::uint64_t* ignored = nullptr;
  std::uint32_t ignored_count = 0;

  /// Stops all bodies that would pass a fixed body.
  /// @param mobile   function from a number below `count` to a body; all movable bodies
  /// @param any_fast 0; shared by the threads of the team
  template <class Team, class Mobile>
  JFPX_HD void run(const Team& team, std::uint32_t count, const Mobile& mobile,
                   std::uint32_t* any_fast) const {
    constexpr std::uint8_t kFast = soft_step::BodyTraits::kIsFast;
    const SubShapeRanges& ranges = sub_shapes.ranges;
    if (ranges.fixed_begin() == ranges.all()) return;
    const std::uint32_t tested_end = tested == nullptr ? ranges.fixed_begin() : tested_count;
    team.for_each(tested_end, [&](std::uint32_t k) {
      const SubShape i = tested == nullptr ? k : tested[k];
      if (!is_fast(i)) return;
      std::uint8_t* const traits = &step.traits[sub_shapes.body(i)];
      store_shared(traits, static_cast<std::uint8_t>(load_shared(traits) | kFast));
      store_shared(any_fast, 1);
    });
    if (*any_fast == 0) return;
    team.for_each(count, [&](std::uint32_t i) {
      const std::uint32_t body = mobile(i);
      if (bodies().is_active(body) && (step.traits[body] & kFast) != 0) stop(body);
    });
  }

 private:
  /// Whether the body of a movable sub-shape may have passed a fixed body: its centre has moved
  /// far, and not as predicted. Also if it has moved very far as predicted, for two cases in which
  /// contacts fail: the search may miss a body that touches the seam of a mesh, and a spinning body
  /// may pass because the arms of its contacts are constant during the step. A body that turns by
  /// more than a radian in a step may even creep through in small steps.
  JFPX_HD bool is_fast(SubShape i) const {
    /// [-], fractions of the least half width. After less, the centre is still outside, also of a
    /// body that was stopped in the step before.
    constexpr Real kFar = Real(0.25), kVeryFar = Real(0.5), kCreep = Real(1. / 64);
    const std::uint32_t body = sub_shapes.body(i);
    if (!bodies().is_active(body)) return false;
    Vec3 motion = step.solver[body].shift, predicted;
    Real size = sub_shapes.bounds(i).radius;
    const bool turns = !is_ball(i);
    if (turns) {
      const Core core = core_of(i);
      size = core.size;
      motion += turn_of(body, core.arm);
      predicted = cross(bodies().angular_velocity[body], core.arm) * bodies().dt;
    }
    const Real size2 = size * size, motion2 = length_squared(motion);
    const Real far2 = size2 * (kFar * kFar);
    const bool is_constrained = turns && step.constrained[body] != 0;
    const bool spins =
        is_constrained && length_squared(bodies().angular_velocity[body] * bodies().dt) > 1;
    if (!(motion2 > (spins ? size2 * (kCreep * kCreep) : far2)) || bodies().sensor[body] != 0) {
      return false;
    }
    const bool any_mesh = sub_shapes.ranges.meshes_begin() < sub_shapes.ranges.bounded();
    const bool any_kinematic = trees.kinematic.block_count > 0;
    if (spins || ((any_mesh || any_kinematic || is_constrained) &&
                  motion2 > size2 * (kVeryFar * kVeryFar))) {
      return true;
    }
    predicted += bodies().predicted_motion(body);
    return length_squared(motion - predicted) > far2;
  }

  /// Stops a body at the first fixed body that one of its cores touches. The body turns before it
  /// moves; if a core touches an immovable body while it turns, the body keeps its orientation. A
  /// body that is set back against its acceleration loses the kinetic energy that it has gained.
  [[gnu::noinline]] JFPX_HD void stop(std::uint32_t body) const {
    soft_step::SolverBody& solver = step.solver[body];
    bool turns = true;
    for_each_core(body, [&](SubShape i, const Core& core) {
      if (core.arm == Vec3{}) return;
      Hit hit;
      sweep({i, bodies().position[body] + core.arm, turn_of(body, core.arm), core.size}, false,
            &hit);
      if (hit.found()) turns = false;
    });
    if (!turns) step.orientation[body] = bodies().orientation[body];
    const Vec3 shift = solver.shift;
    const Hit first = first_hit(body, shift, true);
    if (!first.found()) return;
    solver.shift = first.shift;
    if (first.is_carried) {  // a kinematic body carries no core through an immovable body
      const Hit next = first_hit(body, first.shift, false);
      if (next.found()) solver.shift = next.shift;
    }
    const Real work = dot(step.bodies.last_acceleration[body], shift - solver.shift);
    const Real speed2 = length_squared(solver.velocity);
    if (!(work > 0) || !(speed2 > 0)) return;
    const Real kept = 1 - 2 * work / speed2;
    solver.velocity = solver.velocity * (kept > 0 ? square_root(kept) : Real(0));
  }

  /// The core of a solid is a ball of kCore times the least half width.
  static constexpr Real kCore = Real(0.5);
  struct Core {
    Vec3 arm;       ///< [m], world axes, from the centre of mass at the start of the step
    Real size = 0;  ///< [m], least half width of the solid
  };
  /// A core that moves from a point in the world.
  struct Path {
    SubShape sub_shape;
    Vec3 from, motion;  ///< [m]
    Real size = 0;
  };
  /// The first fixed body that is touched. Several at the same time are ordered, because their
  /// order in the trees is not that of all backends.
  struct Hit {
    Real t = 2;  ///< fraction of the motion
    bool is_carried = false;
    SubShape fixed = 0, sub_shape = 0;
    Vec3 shift;  ///< [m], of the body in the step until it stops

    JFPX_HD bool found() const { return t <= 1; }
    JFPX_HD bool precedes(const Hit& other) const {
      if (t != other.t) return t < other.t;
      if (is_carried != other.is_carried) return other.is_carried;
      return fixed != other.fixed ? fixed < other.fixed : sub_shape < other.sub_shape;
    }
  };

  JFPX_HD const BodyView& bodies() const { return step.bodies; }
  /// Whether the core is at the centre of mass of a body.
  JFPX_HD bool is_ball(SubShape i) const {
    return sub_shapes.is_sphere(i) && !sub_shapes.is_part(i);
  }
  JFPX_HD Core core_of(SubShape i) const {
    Core core{sub_shapes.bounds(i).centre - bodies().position[sub_shapes.body(i)],
              sub_shapes.bounds(i).radius};
    if (sub_shapes.is_sphere(i)) return core;
    sub_shapes.visit_solid(i, [&](const auto& solid, const Transform& pose) {
      core.size = detail::least_half_width(solid);
      core.arm =
          detail::centre_of(detail::instance(solid, pose)) - bodies().position[sub_shapes.body(i)];
    });
    return core;
  }
  /// [m], motion of a point of a body by its rotation in the step.
  JFPX_HD Vec3 turn_of(std::uint32_t body, const Vec3& arm) const {
    if (arm == Vec3{}) return {};
    return TurnSinceTest(step.orientation[body], bodies().orientation[body]).change_of(arm);
  }

  /// Calls visit(sub_shape, core) for the solids of a movable body. The sub-shapes of each kind are
  /// sorted by body.
  template <class Visit>
  JFPX_HD void for_each_core(std::uint32_t body, const Visit& visit) const {
    for (std::uint32_t kind = 0; kind < SubShapeRanges::kSolidKinds; ++kind) {
      SubShape first = sub_shapes.ranges.begin[kind];
      const SubShape end = sub_shapes.ranges.begin[kind + 1];
      for (SubShape last = end; first < last;) {
        const SubShape middle = first + (last - first) / 2;
        if (sub_shapes.body(middle) < body) {
          first = middle + 1;
        } else {
          last = middle;
        }
      }
      for (; first < end && sub_shapes.body(first) == body; ++first) visit(first, core_of(first));
    }
  }

  /// The first hit of all cores after the rotation of the step.
  JFPX_HD Hit first_hit(std::uint32_t body, const Vec3& shift, bool with_kinematic) const {
    Hit first;
    for_each_core(body, [&](SubShape i, const Core& core) {
      const Vec3 arm = core.arm + turn_of(body, core.arm);
      sweep({i, bodies().position[body] + arm, shift, core.size}, with_kinematic, &first);
    });
    return first;
  }

  /// Finds the first fixed body that a core touches.
  /// @param first in: hits of other cores
  JFPX_HD void sweep(const Path& path, bool with_kinematic, Hit* first) const {
    const std::uint32_t body = sub_shapes.body(path.sub_shape);
    const Vec3 to = path.from + path.motion;
    const Real radius = path.size * kCore;
    const Real error = 32 * kEpsilon * (sum(path.from) + sum(to));
    const Real reach = radius * Real(1.25) + error;
    const Vec3 half{reach, reach, reach};
    const Aabb box = merged({path.from - half, path.from + half}, {to - half, to + half});
    const SubShape begin = sub_shapes.ranges.fixed_begin();
    const auto test_item = [&](std::uint32_t item) {
      const SubShape fixed = begin + item;
      if (may_stop(body, fixed)) sweep_to_solid(path, fixed, first);
    };
    trees.immovable.visit_overlapping(box, test_item);
    if (with_kinematic) trees.kinematic.visit_overlapping(box, test_item);
    for (SubShape wall = sub_shapes.ranges.bounded(); wall < sub_shapes.ranges.all(); ++wall) {
      if (!may_stop(body, wall)) continue;
      const HalfSpace solid = sub_shapes.wall(wall).solid_for(bodies().position[body]);
      Real t = 0;
      if (!sweep_core(detail::CoreMotion{path.from, path.motion, radius, error}, solid, &t)) {
        continue;
      }
      const Hit hit{t, false, wall, path.sub_shape, path.motion * t};
      if (hit.precedes(*first)) *first = hit;
    }
  }

  JFPX_HD bool may_stop(std::uint32_t body, SubShape fixed) const {
    const std::uint32_t other = sub_shapes.body(fixed);
    return bodies().sensor[other] == 0 && bodies().may_collide(body, other) &&
           !BodyView::has_pair(ignored, ignored_count, BodyView::key_of(body, other));
  }

  /// In the axes of the solid, whose motion is part of the path. A body that touches a kinematic
  /// body in motion keeps its place relative to it until the end of the step.
  JFPX_HD void sweep_to_solid(const Path& path, SubShape fixed, Hit* first) const {
    const PosedSolid& posed = sub_shapes.solid(fixed);
    const Transform& before = posed.pose;
    const Vec3 to = path.from + path.motion;
    const bool is_carrier = bodies().is_carrier(sub_shapes.body(fixed));
    const Transform after = is_carrier ? pose_at_end(fixed) : before;
    detail::CoreMotion core;
    core.from = inverse_transform_point(before, path.from);
    core.motion = is_carrier ? inverse_transform_point(after, to) - core.from
                             : inverse_transform_direction(before, path.motion);
    core.radius = path.size * kCore;
    core.error = 32 * kEpsilon * (sum(path.from) + sum(to) + sum(before.origin));
    const auto hit_at = [&](Real t) {
      Hit hit{t, is_carrier, fixed, path.sub_shape, path.motion * t};
      if (is_carrier) {
        const Vec3 at = transform_point(after, add_scaled(core.from, core.motion, t));
        hit.shift = path.motion + (at - to);
      }
      if (hit.precedes(*first)) *first = hit;
      return first->t;
    };
    if (sub_shapes.is_mesh(fixed)) {
      sweep_core_to_mesh(core, sub_shapes.mesh(fixed), hit_at);
      return;
    }
    sub_shapes.visit_solid(fixed, [&](const auto& solid, const Transform&) {
      Real t = 0;
      if (sweep_core(core, solid, &t)) hit_at(t);
    });
  }

  /// Pose of a kinematic solid at the end of the step.
  JFPX_HD Transform pose_at_end(SubShape fixed) const {
    const std::uint32_t body = sub_shapes.body(fixed);
    const BodyState state = step.state(body);
    const Transform pose = make_transform(state.orientation, state.position);
    return sub_shapes.is_part(fixed) ? pose * sub_shapes.local[sub_shapes.parts[fixed] - 1] : pose;
  }

  /// Sum of the absolute coordinates.
  JFPX_HD static Real sum(const Vec3& v) { return absolute(v.x) + absolute(v.y) + absolute(v.z); }
};

}  // namespace JFPX_ABI
}  // namespace jfpx
