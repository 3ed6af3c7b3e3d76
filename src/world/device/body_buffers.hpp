/// The bodies of a world in the memory of a device.
#pragma once

#include "src/world/body_store.hpp"
#include "src/world/device/host_copy.hpp"
#include "src/world/device/slot_values.hpp"
#include "src/world/device/step_data.hpp"
#include "src/world/device/transfer.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

template <class Device>
class BodyBuffers {
 public:
  /// Copies all bodies to the device.
  /// @param room number of slots to reserve memory for
  /// @param data gets the addresses
  void upload(const Transfer<Device>& transfer, const BodyStore& store, std::size_t room,
              StepData* data) {
    upload_properties(transfer, store.view(), room, &data->step.bodies);
    upload_motion(transfer, store.moving, room, &data->step);
    data->saved = {transfer.room(&saved_last_acceleration_, room),
                   transfer.room(&saved_mean_motion_, room), transfer.room(&saved_rest_time_, room),
                   transfer.room(&saved_awake_, room)};
  }

  /// Copies forces, and what waking a body changes.
  void upload_forces(const Transfer<Device>& transfer, const MotionArrays& from) {
    transfer.put(&force_, from.force);
    transfer.put(&torque_, from.torque);
    transfer.put(&awake_, from.awake);
    transfer.put(&mean_motion_, from.mean_motion);
    transfer.put(&rest_time_, from.rest_time);
  }

  /// Copies of what BodyState has. @param to as large as the arrays that were uploaded
  HostCopies state_copies(MotionArrays* to) const {
    HostCopies copies;
    add_copy(&copies, &to->position, position_);
    add_copy(&copies, &to->orientation, orientation_);
    add_copy(&copies, &to->velocity, velocity_);
    add_copy(&copies, &to->angular_velocity, angular_velocity_);
    return copies;
  }
  /// Copies of all other arrays, likewise.
  HostCopies other_copies(MotionArrays* to) const {
    HostCopies copies;
    add_copy(&copies, &to->force, force_);
    add_copy(&copies, &to->torque, torque_);
    add_copy(&copies, &to->last_acceleration, last_acceleration_);
    add_copy(&copies, &to->inverse_inertia, inverse_inertia_);
    add_copy(&copies, &to->mean_motion, mean_motion_);
    add_copy(&copies, &to->rest_time, rest_time_);
    add_copy(&copies, &to->awake, awake_);
    return copies;
  }

  /// Undoes what a step changes before it can fail.
  void restore(const Transfer<Device>& transfer, const StepData& data) const {
    const MotionPointers& to = data.step.motion;
    const std::size_t n = data.step.bodies.capacity;
    transfer.copy(to.last_acceleration, data.saved.last_acceleration, n);
    transfer.copy(to.mean_motion, data.saved.mean_motion, n);
    transfer.copy(to.rest_time, data.saved.rest_time, n);
    transfer.copy(to.awake, data.saved.awake, n);
  }

  PropertyPointers properties() const {
    return {.radius = radius_.data(),
            .extent = extent_.data(),
            .inverse_mass = inverse_mass_.data(),
            .friction = friction_.data(),
            .restitution = restitution_.data(),
            .rolling_friction = rolling_friction_.data(),
            .spinning_friction = spinning_friction_.data(),
            .body_inverse_inertia = body_inverse_inertia_.data(),
            .tensor = tensor_.data(),
            .acceleration = acceleration_.data(),
            .velocity_kept = velocity_kept_.data(),
            .angular_velocity_kept = angular_velocity_kept_.data(),
            .can_sleep = can_sleep_.data(),
            .kinematic = kinematic_.data(),
            .sensor = sensor_.data(),
            .filter = filter_.data()};
  }

  void update_pairs(const Transfer<Device>& transfer, const BodyView& from, BodyView* to) {
    to->ignored = transfer.put(&ignored_, from.ignored, from.ignored_count);
    to->ignored_count = from.ignored_count;
  }
  /// Room for the ids of `count` bodies. swap_ids() makes them the current ones.
  BodyId* other_ids(const Transfer<Device>& transfer, std::size_t count) {
    return transfer.room_to_grow(&ids_[1 - ids_now_], count);
  }
  void swap_ids(std::size_t count, BodyView* bodies) {
    ids_now_ = 1 - ids_now_;
    bodies->ids = ids_[ids_now_].data();
    bodies->count = static_cast<std::uint32_t>(count);
  }

  // What accumulates until the next step.
  const Vec3* force() const { return force_.data(); }
  const Vec3* torque() const { return torque_.data(); }

 private:
  template <class T>
  using Buffer = typename Device::template Buffer<T>;

  void upload_properties(const Transfer<Device>& transfer, const BodyView& from, std::size_t room,
                         BodyView* to) {
    const auto put = [&](auto* array, const auto* values) {
      return transfer.put(array, values, from.capacity, room);
    };
    *to = from;  // the numbers; the pointers follow
    to->radius = put(&radius_, from.radius);
    to->extent = put(&extent_, from.extent);
    to->inverse_mass = put(&inverse_mass_, from.inverse_mass);
    to->friction = put(&friction_, from.friction);
    to->restitution = put(&restitution_, from.restitution);
    to->rolling_friction = put(&rolling_friction_, from.rolling_friction);
    to->spinning_friction = put(&spinning_friction_, from.spinning_friction);
    to->velocity_kept = put(&velocity_kept_, from.velocity_kept);
    to->angular_velocity_kept = put(&angular_velocity_kept_, from.angular_velocity_kept);
    to->body_inverse_inertia = put(&body_inverse_inertia_, from.body_inverse_inertia);
    to->tensor = put(&tensor_, from.tensor);
    to->acceleration = put(&acceleration_, from.acceleration);
    to->can_sleep = put(&can_sleep_, from.can_sleep);
    to->kinematic = put(&kinematic_, from.kinematic);
    to->sensor = put(&sensor_, from.sensor);
    to->filter = put(&filter_, from.filter);
    update_pairs(transfer, from, to);
    to->ids = transfer.put(&ids_[ids_now_], from.ids, from.count);
  }

  void upload_motion(const Transfer<Device>& transfer, const MotionArrays& from, std::size_t room,
                     soft_step::StepBodies* step) {
    const auto put = [&](auto* array, const auto& values) {
      return transfer.put(array, values, room);
    };
    MotionPointers& to = step->motion;
    to.position = put(&position_, from.position);
    to.orientation = put(&orientation_, from.orientation);
    to.velocity = put(&velocity_, from.velocity);
    to.angular_velocity = put(&angular_velocity_, from.angular_velocity);
    to.force = put(&force_, from.force);
    to.torque = put(&torque_, from.torque);
    to.last_acceleration = put(&last_acceleration_, from.last_acceleration);
    to.inverse_inertia = put(&inverse_inertia_, from.inverse_inertia);
    to.mean_motion = put(&mean_motion_, from.mean_motion);
    to.rest_time = put(&rest_time_, from.rest_time);
    to.awake = put(&awake_, from.awake);
    BodyView& bodies = step->bodies;
    bodies.position = to.position;
    bodies.orientation = to.orientation;
    bodies.velocity = to.velocity;
    bodies.angular_velocity = to.angular_velocity;
    bodies.force = to.force;
    bodies.torque = to.torque;
    bodies.last_acceleration = to.last_acceleration;
    bodies.inverse_inertia = to.inverse_inertia;
    bodies.rest_time = to.rest_time;
    bodies.awake = to.awake;
  }

  // Properties.
  Buffer<Real> radius_, extent_, inverse_mass_, friction_, restitution_, rolling_friction_,
      spinning_friction_, velocity_kept_, angular_velocity_kept_;
  Buffer<Mat3> body_inverse_inertia_, tensor_;
  Buffer<Vec3> acceleration_;
  Buffer<std::uint8_t> can_sleep_, kinematic_, sensor_;
  Buffer<CollisionFilter> filter_;
  Buffer<std::uint64_t> ignored_;
  Buffer<BodyId> ids_[2];
  int ids_now_ = 0;  ///< which of the two are the current ones
  // Motion.
  Buffer<Vec3> position_, velocity_, angular_velocity_, force_, torque_, last_acceleration_;
  Buffer<Quat> orientation_;
  Buffer<Mat3> inverse_inertia_;
  Buffer<Real> mean_motion_, rest_time_;
  Buffer<std::uint8_t> awake_;
  // SavedArrays.
  Buffer<Vec3> saved_last_acceleration_;
  Buffer<Real> saved_mean_motion_, saved_rest_time_;
  Buffer<std::uint8_t> saved_awake_;
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
