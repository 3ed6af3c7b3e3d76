/// The bodies of a world as pointers to arrays, in host memory or on a device, and functions of one
/// body.
#pragma once

#include <jfpx/scene.hpp>

#include "src/scene/inertia.hpp"
#include "src/world/bodies/body_columns.hpp"
#include "src/world/bodies/integrate.hpp"
#include "src/world/bodies/motion_locks.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

/// Properties and state of bodies that the steps of a world read. The pointers of InertiaColumns
/// are null if the world has no inertia columns.
struct BodyView : MotionColumns<ConstPointerColumn>,
                  PropertyColumns<ConstPointerColumn>,
                  InertiaColumns<ConstPointerColumn> {
  const std::uint64_t* ignored = nullptr;  ///< keys of IgnoredPairs, sorted
  std::uint32_t ignored_count = 0;
  const std::uint64_t* joined = nullptr;  ///< keys of pairs excluded by joints, sorted
  std::uint32_t joined_count = 0;
  bool filters_in_use = false;
  bool any_locks = false;  ///< whether a body may have `motion_locks`

  const BodyId* ids = nullptr;  ///< of the living bodies, sorted by index
  std::uint32_t count = 0;      ///< number of ids
  std::uint32_t capacity = 0;   ///< number of slots
  std::uint32_t movable_count = 0;
  bool has_blocks = false;   ///< BodyStore::has_blocks()
  Real dt = 0, substep = 0;  ///< [s]
  Real sleep_speed = 0;      ///< [m/s]
  Real sleep_time = 0;       ///< [s]
  Real woken_motion = 0;     ///< [m^2/s^2], mean motion of a body that wakes

  JFPX_HD bool movable(std::uint32_t i) const { return inverse_mass[i] > 0; }
  /// Whether the body is movable and awake.
  JFPX_HD bool is_active(std::uint32_t i) const { return movable(i) && awake[i] != 0; }
  JFPX_HD bool is_asleep(std::uint32_t i) const { return movable(i) && awake[i] == 0; }
  /// Whether the body is kinematic and in motion.
  JFPX_HD bool is_carrier(std::uint32_t i) const { return !movable(i) && awake[i] != 0; }
  /// Whether the body is a movable sphere whose inertia is the same about every axis. Also a sphere
  /// that does not rotate: its inertia is infinite.
  JFPX_HD bool is_round(std::uint32_t i) const {
    return movable(i) && radius[i] > 0 && !has_gyroscopic_term(i) &&
           (!locks_rotation(i) || keeps_orientation(i));
  }
  /// Whether the body does not rotate about an axis, and whether it does not rotate at all.
  JFPX_HD bool locks_rotation(std::uint32_t i) const {
    return any_locks && detail::any_angular(motion_locks[i]);
  }
  JFPX_HD bool keeps_orientation(std::uint32_t i) const {
    return any_locks && detail::all_angular(motion_locks[i]);
  }
  /// Whether the body does not move along any axis.
  JFPX_HD bool keeps_position(std::uint32_t i) const {
    return any_locks && detail::all_linear(motion_locks[i]);
  }
  /// Whether the body is kinematic and its pose does not follow its velocities along or about some
  /// axes: its surface moves, as that of a conveyor belt or of a turntable.
  JFPX_HD bool is_conveyor(std::uint32_t i) const {
    return any_locks && is_carrier(i) && !(motion_locks[i] == MotionLocks{});
  }
  /// Angular velocity with which the orientation changes [rad/s].
  JFPX_HD Vec3 turning(std::uint32_t i) const {
    return any_locks ? detail::free_angular(motion_locks[i], angular_velocity[i])
                     : angular_velocity[i];
  }
  /// The part of an acceleration or a motion that the locks of a body admit.
  JFPX_HD Vec3 admitted(std::uint32_t i, const Vec3& motion) const {
    return any_locks ? detail::free_linear(motion_locks[i], motion) : motion;
  }
  JFPX_HD bool has_gyroscopic_term(std::uint32_t i) const {
    return tensor != nullptr && tensor[i](0, 0) > 0;
  }
  JFPX_HD bool is_at_rest(std::uint32_t i) const { return rest_time[i] >= sleep_time; }
  /// Whether a body was slow in the last step, and nothing has woken it since.
  JFPX_HD bool is_slow(std::uint32_t i) const { return rest_time[i] > 0; }

  JFPX_HD bool may_collide(std::uint32_t a, std::uint32_t b) const {
    return !filters_in_use || (jfpx::may_collide(filter[a], filter[b]) && !is_ignored(a, b));
  }
  JFPX_HD bool is_ignored(std::uint32_t a, std::uint32_t b) const {
    const std::uint64_t key = key_of(a, b);
    return has_pair(ignored, ignored_count, key) || has_pair(joined, joined_count, key);
  }
  /// As in IgnoredPairs.
  JFPX_HD static std::uint64_t key_of(std::uint32_t a, std::uint32_t b) {
    return a < b ? std::uint64_t{a} << 32 | b : std::uint64_t{b} << 32 | a;
  }
  /// Binary search in sorted keys of pairs.
  JFPX_HD static bool has_pair(const std::uint64_t* keys, std::uint32_t count, std::uint64_t key) {
    std::uint32_t first = 0, last = count;
    while (first < last) {
      const std::uint32_t middle = first + (last - first) / 2;
      if (keys[middle] < key) {
        first = middle + 1;
      } else {
        last = middle;
      }
    }
    return first < count && keys[first] == key;
  }

  /// Acceleration of a movable body by its constant acceleration and the accumulated force.
  JFPX_HD Vec3 acceleration_of_step(std::uint32_t i) const {
    return admitted(i, add_scaled(acceleration[i], force[i], inverse_mass[i]));
  }

  /// Displacement of the centre of mass during the next step, without contacts and damping [m];
  /// zero for a body at rest, and for one so fast that it leaves the world.
  JFPX_HD Vec3 predicted_motion(std::uint32_t i) const {
    if (awake[i] == 0) return {};
    const Vec3 gained = movable(i) ? acceleration_of_step(i) : Vec3{};
    const Vec3 motion = admitted(i, add_scaled(velocity[i], gained, dt) * dt);
    constexpr Real kFarthest = 2 * kMaxCoordinate;
    const bool stays = absolute(motion.x) <= kFarthest && absolute(motion.y) <= kFarthest &&
                       absolute(motion.z) <= kFarthest;
    return stays ? motion : Vec3{};
  }

  /// Angular acceleration of a movable body by the accumulated torque [rad/s^2].
  JFPX_HD Vec3 angular_acceleration_of_step(std::uint32_t i) const {
    // The product of the inertia and a zero torque is +0, so the inertia is not read.
    return torque[i] == Vec3{} ? Vec3{} : inverse_inertia[i] * torque[i];
  }

  /// The angular velocity after the gyroscopic torque of a substep.
  /// @param orientation_now at the start of the substep
  JFPX_HD void turn_gyroscopically(std::uint32_t i, const Quat& orientation_now, Vec3* w) const {
    // Unlike precessed(), this does not transform the velocity to body axes and back. Rounding
    // makes the axes slightly non-orthonormal with a systematic sign, so the energy would grow
    // noticeably with many substeps.
    const Mat3 axes = to_matrix(orientation_now);
    Vec3 change;
    const Vec3 local = transform_transpose(axes, *w);
    if (detail::momentum_keeping_change(local, tensor[i], body_inverse_inertia[i], substep,
                                        &change)) {
      *w += axes * change;
    }
  }
};

/// Motion of a body in a step.
struct StepMotion {
  Vec3 shift;            ///< [m], of the centre of mass
  Real turn = 0;         ///< [rad], angle of the rotation, to first order
  Vec3 velocity_change;  ///< [m/s]
};

/// The arrays of a BodyView that a step of soft_step changes.
struct MotionPointers : MotionColumns<PointerColumn> {
  JFPX_HD void refresh_inertia(const BodyView& bodies, std::uint32_t i) const {
    const Mat3& inverse = bodies.body_inverse_inertia[i];
    const Mat3 axes = to_matrix(orientation[i]);
    inverse_inertia[i] = bodies.locks_rotation(i)
                             ? detail::locked_inverse_inertia(bodies.motion_locks[i], inverse, axes)
                             : detail::in_world_axes(inverse, axes);
  }

  /// Wakes a movable body.
  JFPX_HD void wake(const BodyView& bodies, std::uint32_t i) const {
    wake_by_slow_body(bodies, i);
    rest_time[i] = 0;
  }
  /// Wakes a sleeping body whose island touches slow bodies only. The rest time is not reset:
  /// otherwise two islands could wake each other alternately and never sleep.
  JFPX_HD void wake_by_slow_body(const BodyView& bodies, std::uint32_t i) const {
    awake[i] = 1;
    mean_motion[i] = bodies.woken_motion;
  }

  JFPX_HD void put_to_sleep(std::uint32_t i) const {
    awake[i] = 0;
    velocity[i] = angular_velocity[i] = {};
  }

  /// Stores the final state of an awake body.
  JFPX_HD void end_step(const BodyView& bodies, std::uint32_t i, const BodyState& state) const {
    position[i] = state.position;
    // Not only equal up to the rounding of normalized().
    if (!bodies.keeps_orientation(i)) orientation[i] = state.orientation;
    velocity[i] = state.velocity;
    angular_velocity[i] = state.angular_velocity;
    if (!bodies.is_round(i)) refresh_inertia(bodies, i);
  }

  /// Updates the time for which the body has been slow. A body under a force has a lower threshold:
  /// at the ordinary speed, a damped spring would fall asleep far from its equilibrium. The
  /// rotation of a sphere has a smaller weight, because it leaves the surface in place, and no
  /// friction ends a rotation about the contact normal.
  ///
  /// The speed is that of the displacement, which includes the push-out of penetrations. The
  /// velocity at the end of the step may contain a part that the next substep cancels before the
  /// body moves.
  /// @param motion of the step
  JFPX_HD void update_rest_time(const BodyView& bodies, std::uint32_t i, bool is_driven,
                                const StepMotion& motion) const {
    constexpr Real kDriven = Real(0.04), kRotationOfSphere = Real(0.04);
    const Real limit = (is_driven ? bodies.sleep_speed * kDriven : bodies.sleep_speed) * bodies.dt;
    const Real weight = bodies.radius[i] > 0 ? kRotationOfSphere : Real(1);
    const Real spin = motion.turn * bodies.extent[i] * weight;
    const Real linear = length(motion.shift);
    const Real distance = linear < spin ? spin : linear;
    const bool is_slow = bodies.can_sleep[i] != 0 && distance <= limit &&
                         !falls_freely(bodies.admitted(i, bodies.acceleration[i]) * bodies.dt,
                                       motion.velocity_change);
    rest_time[i] = is_slow ? rest_time[i] + bodies.dt : Real(0);
  }

 private:
  /// Whether a body falls like one without contacts, although it may be slow.
  /// @param free [m/s], change of the velocity by the constant acceleration in a step
  JFPX_HD static bool falls_freely(const Vec3& free, const Vec3& velocity_change) {
    return !(free == Vec3{}) &&
           length_squared(velocity_change - free) <= Real(0.25) * length_squared(free);
  }
};

/// Whether all values of a state are finite, and no coordinate is above kMaxCoordinate.
JFPX_HD inline bool is_in_world(const BodyState& state) {
  const Vec3& x = state.position;
  const bool is_near = absolute(x.x) <= kMaxCoordinate && absolute(x.y) <= kMaxCoordinate &&
                       absolute(x.z) <= kMaxCoordinate;
  // If the square of the angular velocity overflows, normalized() returns a zero quaternion.
  const bool is_rotation = length_squared(state.orientation) > Real(0.5);
  return is_near && is_rotation && is_finite(state.orientation) && is_finite(state.velocity) &&
         is_finite(state.angular_velocity);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
