/// The joints of a world in the memory of a device.
#pragma once

#include "src/world/device/step_data.hpp"
#include "src/world/device/transfer.hpp"
#include "src/world/joints/joint_store.hpp"

#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

template <class Device>
class JointBuffers {
 public:
  /// Replaces the joints by those of the host. Waits for the copies.
  /// @param last index in DeviceJoints::kept of the impulses of the last step
  /// @param room number of slots of bodies to reserve memory for
  /// @param parts largest StepData::parts of a step
  void upload(const Transfer<Device>& transfer, const soft_step::JointView& from,
              std::uint64_t last, std::size_t room, std::size_t parts, StepData* data) {
    DeviceJoints& to = data->world_joints;
    const PageLayout by_part{.index = ArrayIndex::equal};
    to.count = from.count;
    to.inputs = transfer.put(&inputs_, from.inputs, from.count);
    transfer.put(&kept_[last], from.last, from.count);
    transfer.room(&kept_[1 - last], from.count);
    for (int i = 0; i < 2; ++i) to.kept[i] = kept_[i].data();
    if (from.count > 0) {
      data->orientation_cells = transfer.room(&orientation_cells_, room);
      data->step.moved_rotation = transfer.room(&moved_rotation_, room);
      for (std::uint32_t& count : to.of_kind) count = 0;
      for (std::uint32_t joint = 0; joint < from.count; ++joint) {
        if (!from.is_used(joint)) continue;
        const soft_step::RowKind kind = soft_step::kind_of_joint(from.inputs[joint].type);
        ++to.of_kind[kind - soft_step::kContactRowKinds];
      }
      data->distance_rows = transfer.room_to_grow(&distance_rows_, parts * to.of_kind[0], by_part);
      data->frame_rows = transfer.room_to_grow(&frame_rows_, parts * to.of_kind[1], by_part);
    }
    transfer.wait();
  }

  void fetch(const Transfer<Device>& transfer, std::uint64_t last, JointStore* to) const {
    transfer.get(&to->last(), kept_[last]);
    transfer.wait();
  }

 private:
  template <class T>
  using Buffer = typename Device::template Buffer<T>;

  Buffer<soft_step::JointInput> inputs_;
  Buffer<soft_step::KeptJoint> kept_[2];
  Buffer<OrientationCells> orientation_cells_;
  Buffer<Vec3> moved_rotation_;
  Buffer<soft_step::DistanceRow> distance_rows_;
  Buffer<soft_step::FrameRow> frame_rows_;
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
