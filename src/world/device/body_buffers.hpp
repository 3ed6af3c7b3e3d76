/// The bodies of a world in the memory of a device.
#pragma once

#include "src/world/bodies/body_store.hpp"
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
  /// @param data receives the addresses
  void upload(const Transfer<Device>& transfer, const BodyStore& store, std::size_t room,
              StepData* data) {
    upload_properties(transfer, store.view(), room, &data->step.bodies);
    upload_motion(transfer, store.moving, room, &data->step);
    each_saved([&](auto*& to, auto& buffer) { to = transfer.room(&buffer, room); }, data->saved,
               saved_);
  }

  /// Copies forces, and the columns that change when a body wakes.
  void upload_forces(const Transfer<Device>& transfer, const MotionArrays& from) {
    transfer.put(&motion_.force, from.force);
    transfer.put(&motion_.torque, from.torque);
    transfer.put(&motion_.awake, from.awake);
    transfer.put(&motion_.mean_motion, from.mean_motion);
    transfer.put(&motion_.rest_time, from.rest_time);
  }

  /// Copies of the columns of BodyState. @param to as large as the uploaded arrays
  HostCopies state_copies(MotionArrays* to) const {
    HostCopies copies;
    each_state(copy_to(&copies), *to, motion_);
    return copies;
  }
  /// Copies of all other arrays. @param to as large as the uploaded arrays
  HostCopies other_copies(MotionArrays* to) const {
    HostCopies copies;
    each_other_motion(copy_to(&copies), *to, motion_);
    return copies;
  }

  /// Restores the columns that a step changes before it can fail.
  void restore(const Transfer<Device>& transfer, const StepData& data) const {
    const std::size_t n = data.step.bodies.capacity;
    each_saved([&](auto* to, const auto* from) { transfer.copy(to, from, n); }, data.step.motion,
               data.saved);
  }

  PropertyPointers properties() const {
    PropertyPointers pointers;
    const auto point_to = [](auto*& pointer, const auto& buffer) { pointer = buffer.data(); };
    each_property(point_to, pointers, properties_);
    each_inertia(point_to, pointers, inertia_);
    return pointers;
  }

  void update_pairs(const Transfer<Device>& transfer, const BodyView& from, BodyView* to) {
    to->ignored = transfer.put(&ignored_, from.ignored, from.ignored_count);
    to->ignored_count = from.ignored_count;
    to->joined = transfer.put(&joined_, from.joined, from.joined_count);
    to->joined_count = from.joined_count;
  }
  /// Room for the ids of `count` bodies. swap_ids() makes them the current ones.
  BodyId* other_ids(const Transfer<Device>& transfer, std::size_t count) {
    return transfer.room_to_grow(&ids_[1 - ids_now_], count, {.index = ArrayIndex::body});
  }
  void swap_ids(std::size_t count, BodyView* bodies) {
    ids_now_ = 1 - ids_now_;
    bodies->ids = ids_[ids_now_].data();
    bodies->count = static_cast<std::uint32_t>(count);
  }

  // Sums that accumulate until the next step.
  const Vec3* force() const { return motion_.force.data(); }
  const Vec3* torque() const { return motion_.torque.data(); }

 private:
  template <class T>
  using Buffer = typename Device::template Buffer<T>;

  void upload_properties(const Transfer<Device>& transfer, const BodyView& from, std::size_t room,
                         BodyView* to) {
    *to = from;  // copies the numbers; the pointers are set below
    const auto put = [&](auto*& pointer, auto& buffer, const auto* values) {
      pointer = transfer.put(&buffer, values, from.capacity, room);
    };
    each_property(put, *to, properties_, from);
    each_inertia(put, *to, inertia_, from);
    update_pairs(transfer, from, to);
    to->ids = transfer.put(&ids_[ids_now_], from.ids, from.count, 0, ArrayIndex::body);
  }

  void upload_motion(const Transfer<Device>& transfer, const MotionArrays& from, std::size_t room,
                     soft_step::StepBodies* step) {
    each_motion([&](auto*& pointer, auto*& view, auto& buffer,
                    const auto& values) { view = pointer = transfer.put(&buffer, values, room); },
                step->motion, step->bodies, motion_, from);
  }

  static auto copy_to(HostCopies* copies) {
    return [copies](auto& to, const auto& from) { add_copy(copies, &to, from); };
  }

  PropertyColumns<Buffer> properties_;
  InertiaColumns<Buffer> inertia_;
  Buffer<std::uint64_t> ignored_, joined_;
  Buffer<BodyId> ids_[2];
  int ids_now_ = 0;  ///< index of the current buffer
  MotionColumns<Buffer> motion_;
  SavedColumns<Buffer> saved_;
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
