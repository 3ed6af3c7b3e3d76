/// All values of one body, for a device that gets a body between two steps.
#pragma once

#include "src/world/body_store.hpp"
#include "src/world/body_view.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// The arrays of a BodyView that no step changes.
struct PropertyPointers {
  Real *radius = nullptr, *extent = nullptr, *inverse_mass = nullptr;
  Real *friction = nullptr, *restitution = nullptr;
  Real *rolling_friction = nullptr, *spinning_friction = nullptr;
  Mat3 *body_inverse_inertia = nullptr, *tensor = nullptr;
  Vec3* acceleration = nullptr;
  Real *velocity_kept = nullptr, *angular_velocity_kept = nullptr;
  std::uint8_t *can_sleep = nullptr, *kinematic = nullptr, *sensor = nullptr;
  CollisionFilter* filter = nullptr;
};

/// The values of a slot of the arrays of bodies. See BodyView and MotionArrays for their meaning.
struct SlotValues {
  std::uint32_t body = 0;
  std::uint8_t awake = 0, can_sleep = 0, kinematic = 0, sensor = 0;
  bool has_no_contacts = false;  ///< with the body that had the slot in the last step
  BodyState state;
  Vec3 force, torque, last_acceleration, acceleration;
  Mat3 inverse_inertia, body_inverse_inertia, tensor;
  Real mean_motion = 0, rest_time = 0;
  Real radius = 0, extent = 0, inverse_mass = 0, friction = 0, restitution = 0;
  Real rolling_friction = 0, spinning_friction = 0;
  Real velocity_kept = 1, angular_velocity_kept = 1;
  CollisionFilter filter;

  JFPX_HD void store(const MotionPointers& motion, const PropertyPointers& properties) const {
    motion.position[body] = state.position;
    motion.orientation[body] = state.orientation;
    motion.velocity[body] = state.velocity;
    motion.angular_velocity[body] = state.angular_velocity;
    motion.force[body] = force;
    motion.torque[body] = torque;
    motion.last_acceleration[body] = last_acceleration;
    motion.inverse_inertia[body] = inverse_inertia;
    motion.mean_motion[body] = mean_motion;
    motion.rest_time[body] = rest_time;
    motion.awake[body] = awake;
    properties.radius[body] = radius;
    properties.extent[body] = extent;
    properties.inverse_mass[body] = inverse_mass;
    properties.friction[body] = friction;
    properties.restitution[body] = restitution;
    properties.rolling_friction[body] = rolling_friction;
    properties.spinning_friction[body] = spinning_friction;
    properties.body_inverse_inertia[body] = body_inverse_inertia;
    properties.tensor[body] = tensor;
    properties.acceleration[body] = acceleration;
    properties.velocity_kept[body] = velocity_kept;
    properties.angular_velocity_kept[body] = angular_velocity_kept;
    properties.can_sleep[body] = can_sleep;
    properties.kinematic[body] = kinematic;
    properties.sensor[body] = sensor;
    properties.filter[body] = filter;
  }
};

/// The values of a body on the host. @param from the arrays of `store`
inline SlotValues slot_values(const BodyStore& store, const BodyView& from, std::uint32_t i) {
  return {.body = i,
          .awake = from.awake[i],
          .can_sleep = from.can_sleep[i],
          .kinematic = from.kinematic[i],
          .sensor = from.sensor[i],
          .state = store.state(i),
          .force = from.force[i],
          .torque = from.torque[i],
          .last_acceleration = from.last_acceleration[i],
          .acceleration = from.acceleration[i],
          .inverse_inertia = from.inverse_inertia[i],
          .body_inverse_inertia = from.body_inverse_inertia[i],
          .tensor = from.tensor[i],
          .mean_motion = store.moving.mean_motion[i],
          .rest_time = from.rest_time[i],
          .radius = from.radius[i],
          .extent = from.extent[i],
          .inverse_mass = from.inverse_mass[i],
          .friction = from.friction[i],
          .restitution = from.restitution[i],
          .rolling_friction = from.rolling_friction[i],
          .spinning_friction = from.spinning_friction[i],
          .velocity_kept = from.velocity_kept[i],
          .angular_velocity_kept = from.angular_velocity_kept[i],
          .filter = from.filter[i]};
}

/// An unused slot: a body that neither moves nor has contacts.
inline SlotValues unused_slot(std::uint32_t i) {
  SlotValues unused;
  unused.body = i;
  return unused;
}

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
