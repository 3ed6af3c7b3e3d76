/// The stages of a soft step for one body or one contact, for the CPU and for devices.
#pragma once

#include "src/contact_solver/soft_step/contact_set.hpp"
#include "src/contact_solver/soft_step/joint_set.hpp"
#include "src/contact_solver/soft_step/row_setup.hpp"
#include "src/world/bodies/body_view.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// Whether the bodies of a contact touch, or will touch during the step at their velocities.
JFPX_HD inline bool will_touch(const BodyView& bodies, const ContactView& contacts,
                               std::uint32_t contact) {
  const ContactKey& key = contacts.key(contact);
  const Vec3 motion = bodies.predicted_motion(key.a) - bodies.predicted_motion(key.b);
  const Real opening = dot(motion, contacts.normal(contact));
  return contacts.any_point(contact, [opening](Real distance, const KeptImpulse& impulse) {
    return distance <= 0 || distance + opening <= 0 || impulse.normal > 0;
  });
}

/// Whether the bodies of a contact touched, or pushed each other, during the step.
JFPX_HD inline bool has_touched(const ContactView& contacts, std::uint32_t contact) {
  return contacts.any_point(contact, [](Real distance, const KeptImpulse& impulse) {
    return distance <= 0 || impulse.has_pushed();
  });
}

/// Reasons for waking an island: contact with a kinematic body in motion or a body that is not
/// slow, or contact with slow bodies only.
inline constexpr std::uint8_t kTouchesFastBody = 1, kTouchesSlowBody = 2;

/// Wakes a body of an island. @param mark of the island; 0: the island stays asleep
JFPX_HD inline void wake_touched(const BodyView& bodies, const MotionPointers& motion,
                                 std::uint32_t i, std::uint8_t mark) {
  if (mark == kTouchesFastBody) motion.wake(bodies, i);
  if (mark == kTouchesSlowBody) motion.wake_by_slow_body(bodies, i);
}

/// Calls f(a, b) if a joint is one of two bodies.
template <class F>
JFPX_HD inline void with_joined_bodies(const JointView& joints, std::uint32_t joint, const F& f) {
  if (!joints.is_used(joint) || joints.inputs[joint].b == kWorld) return;
  f(joints.inputs[joint].a, joints.inputs[joint].b);
}

/// What the substeps read of an active body. It is constant during a step.
struct alignas(16) SubstepBody {
  /// Bits of `flags`.
  static constexpr std::uint32_t kIsFree = 1;  ///< the body has neither contacts nor joints
  static constexpr std::uint32_t kHasForce = 2, kHasJoints = 4, kIsGyroscopic = 8;

  Vec3 acceleration;          ///< [m/s^2], of the step
  Real velocity_kept = 1;     ///< [-], by damping, per substep
  Vec3 angular_acceleration;  ///< [rad/s^2]
  Real angular_velocity_kept = 1;
  std::uint32_t flags = 0;
  std::uint32_t unused[3] = {};  ///< instead of padding

  JFPX_HD bool has(std::uint32_t flag) const { return (flags & flag) != 0; }
};

/// [-], factor of the inverse mass of a body that does not move along any axis. Rows act on it as
/// on an immovable body, but none of them divides by 0.
inline constexpr Real kHeldInverseMass = Real(1) / (1 << 20);

/// The bodies of a step, as arrays by body.
struct StepBodies {
  BodyView bodies;
  MotionPointers motion;  ///< of the same bodies
  SolverBody* solver = nullptr;
  std::uint8_t* traits = nullptr;             ///< bits of BodyTraits
  Quat* orientation = nullptr;                ///< during the step
  const std::uint8_t* constrained = nullptr;  ///< one of the values above, or 0
  /// SolverBody::rotation after the last move, of bodies with joints.
  Vec3* moved_rotation = nullptr;
  Real h = 0;  ///< [s], length of a substep

  /// Initializes a body for the step.
  JFPX_HD void load(std::uint32_t i) const {
    if (bodies.is_active(i)) {
      motion.last_acceleration[i] = bodies.acceleration_of_step(i);
    }
    SolverBody body;
    body.velocity = bodies.velocity[i];
    body.angular_velocity = bodies.angular_velocity[i];
    body.inverse_mass = bodies.inverse_mass[i];
    if (bodies.keeps_position(i)) body.inverse_mass *= kHeldInverseMass;
    const bool is_round = bodies.is_round(i);
    if (is_round) body.inverse_inertia = bodies.inverse_inertia[i](0, 0);
    solver[i] = body;
    traits[i] = traits_of(i, is_round);
    orientation[i] = bodies.orientation[i];
    if (constrained[i] >= kHasJoint) moved_rotation[i] = {};
  }

  JFPX_HD std::uint8_t traits_of(std::uint32_t i, bool is_round) const {
    const bool is_movable = bodies.movable(i), is_awake = bodies.awake[i] != 0;
    std::uint8_t bits = is_movable ? BodyTraits::kMovable : 0;
    if (is_movable && is_awake) bits |= BodyTraits::kActive;
    if (is_movable ? is_round : !is_awake) bits |= BodyTraits::kIsRound;
    if (bodies.rolling_friction[i] > 0 || bodies.spinning_friction[i] > 0) {
      bits |= BodyTraits::kRolls;
    }
    return bits;
  }

  /// @param i an active body, for which load() was called
  JFPX_HD SubstepBody substep_body(std::uint32_t i) const {
    SubstepBody body;
    body.acceleration = bodies.last_acceleration[i];
    body.velocity_kept = bodies.velocity_kept[i];
    body.angular_acceleration = bodies.angular_acceleration_of_step(i);
    body.angular_velocity_kept = bodies.angular_velocity_kept[i];
    if (constrained[i] == 0) body.flags |= SubstepBody::kIsFree;
    if (!(bodies.force[i] == Vec3{})) body.flags |= SubstepBody::kHasForce;
    if (constrained[i] >= kHasJoint) body.flags |= SubstepBody::kHasJoints;
    if (bodies.has_gyroscopic_term(i)) body.flags |= SubstepBody::kIsGyroscopic;
    return body;
  }

  /// Starts a substep: applies accelerations and, except in the first substep, the contact impulses
  /// of the last substep. A body without contacts moves by the mean of its velocities before and
  /// after, so its path is an exact parabola. With contacts, the mean would contain acceleration
  /// that the impulses have cancelled. Forces, which may depend on the position, are constant in a
  /// step and integrated by semi-implicit Euler over the whole step; otherwise springs would gain
  /// energy.
  /// @param i               an active body
  /// @param constants       substep_body(i)
  /// @param orientation_now at the start of the substep
  JFPX_HD void accelerate(std::uint32_t i, const SubstepBody& constants,
                          const Quat& orientation_now, SolverBody* body, FreeMotion* free,
                          bool is_first) const {
    const Vec3 velocity = detail::integrated_velocity(body->velocity, constants.acceleration, h,
                                                      constants.velocity_kept);
    Vec3 angular_velocity = detail::integrated_velocity(
        body->angular_velocity, constants.angular_acceleration, h, constants.angular_velocity_kept);
    if (constants.has(SubstepBody::kIsGyroscopic)) {
      bodies.turn_gyroscopically(i, orientation_now, &angular_velocity);
    }
    if (constants.has(SubstepBody::kIsFree)) {
      body->shift = add_scaled(body->shift, body->velocity - velocity, h * Real(0.5));
      if (constants.has(SubstepBody::kHasForce)) {
        const Real half_step = h * bodies.dt * Real(0.5);
        body->shift = add_scaled(body->shift, constants.acceleration, half_step);
      }
    }
    const Vec3 gained = is_first ? Vec3{} : body->velocity - free->velocity;
    const Vec3 spun = is_first ? Vec3{} : body->angular_velocity - free->angular_velocity;
    *free = {velocity, angular_velocity};
    body->velocity = velocity + gained;
    body->angular_velocity = angular_velocity + spun;
    hold(i, body);
  }

  /// Ends the motion of a body along its locked axes. The rows of contacts and joints use one
  /// inverse mass for all directions. The locks thus act like a row that is solved after sweeps,
  /// as in Box2D. Locked rotations need nothing: the inverse inertia has them.
  JFPX_HD void hold(std::uint32_t i, SolverBody* body) const {
    if (!bodies.any_locks || !bodies.movable(i)) return;
    body->velocity = bodies.admitted(i, body->velocity);
    body->shift = bodies.admitted(i, body->shift);
  }

  /// Ends a substep: integrates the velocities of a body that moves.
  /// @param i               an awake body
  /// @param has_joints      whether rows of joints project its rotation
  /// @param orientation_now changes
  JFPX_HD void move(std::uint32_t i, bool has_joints, Quat* orientation_now,
                    SolverBody* body) const {
    hold(i, body);
    const FreeMotion pose = motion_of_pose(i, *body);
    body->shift = add_scaled(body->shift, pose.velocity, h);
    *orientation_now = turned(*orientation_now, pose.angular_velocity);
    if (has_joints) {
      const Vec3 projected = body->rotation - moved_rotation[i];
      if (!(projected == Vec3{})) *orientation_now = rotated_by(*orientation_now, projected);
    }
    body->rotation = add_scaled(body->rotation, pose.angular_velocity, h);
    if (has_joints) moved_rotation[i] = body->rotation;
  }

  /// The velocities with which the pose of a body changes: those of the body, or of a conveyor
  /// those along and about free axes.
  JFPX_HD FreeMotion motion_of_pose(std::uint32_t i, const SolverBody& body) const {
    if (!bodies.is_conveyor(i)) return {body.velocity, body.angular_velocity};
    const MotionLocks& locks = bodies.motion_locks[i];
    return {detail::free_linear(locks, body.velocity),
            detail::free_angular(locks, body.angular_velocity)};
  }
  /// The orientation of a body after a substep. An overflow makes it zero until the step is undone.
  JFPX_HD Quat turned(const Quat& before, const Vec3& angular_velocity) const {
    if (before == Quat{0, 0, 0, 0}) return before;
    return detail::integrated_orientation(before, angular_velocity, h);
  }

  /// State of an awake body at the end of the step.
  JFPX_HD BodyState state(std::uint32_t i) const { return state(i, at_end(i)); }

  /// [rad], angle of the rotation of a body in the step, to first order. Not SolverBody::rotation,
  /// which a device leaves out in steps without manifolds.
  JFPX_HD Real turn_of_step(std::uint32_t i) const {
    constexpr Real kFast = 1;  // [rad]; a difference of orientations shows no whole turns
    const Real turn = length(solver[i].angular_velocity) * bodies.dt;
    if (turn > kFast) return turn;
    const Quat change = orientation[i] * conjugate(bodies.orientation[i]);
    return 2 * length(Vec3{change.x, change.y, change.z});
  }

  /// Ends the step. @returns whether the body has been slow for long enough to sleep
  JFPX_HD bool store(std::uint32_t i) const {
    bool rests = false;
    if (bodies.awake[i] != 0) {
      const SolverBody body = at_end(i);
      const StepMotion moved{body.shift, turn_of_step(i), body.velocity - bodies.velocity[i]};
      motion.end_step(bodies, i, state(i, body));
      if (bodies.movable(i)) {
        const bool is_driven = !(bodies.force[i] == Vec3{} && bodies.torque[i] == Vec3{}) ||
                               constrained[i] == kHasDrive;
        motion.update_rest_time(bodies, i, is_driven, moved);
        rests = bodies.is_at_rest(i);
      }
    }
    motion.force[i] = motion.torque[i] = {};
    return rests;
  }

 private:
  /// Motion of a body after the last sweep.
  JFPX_HD SolverBody at_end(std::uint32_t i) const {
    SolverBody body = solver[i];
    hold(i, &body);
    return body;
  }
  JFPX_HD BodyState state(std::uint32_t i, const SolverBody& body) const {
    return {bodies.position[i] + body.shift, orientation[i], body.velocity, body.angular_velocity};
  }
};

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
