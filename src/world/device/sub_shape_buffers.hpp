/// The sub-shapes of the bodies in the memory of a device.
#pragma once

#include "src/world/device/hull_buffers.hpp"
#include "src/world/device/merge_program.hpp"
#include "src/world/device/step_data.hpp"
#include "src/world/device/transfer.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

template <class Device>
class SubShapeBuffers {
 public:
  /// Copies sub-shapes to the device, with memory for parts of compounds that are added later.
  /// @param part_count number of parts of compounds
  void upload(const Transfer<Device>& transfer, const SubShapeView& from, std::size_t part_count,
              HullBuffers<Device>* hulls) {
    const std::uint32_t bounded = from.ranges.bounded();
    ranges_ = from.ranges;
    part_count_ = static_cast<std::uint32_t>(part_count);
    part_room_ = 2 * part_count + 1024;
    constexpr ArrayIndex kIndex = ArrayIndex::sub_shape;
    transfer.put(&bodies_, from.bodies, ranges_.all(), 0, kIndex);
    transfer.put(&numbers_, from.numbers, ranges_.all(), 0, kIndex);
    transfer.put(&bounds_, from.all_bounds, bounded, 0, kIndex);
    const std::size_t solids = bounded - ranges_.spheres();
    transfer.put(&solids_, hulls->on_device(transfer, from.solids, solids, &solids_on_device_),
                 solids, 0, ArrayIndex::equal);
    transfer.put(&walls_, from.walls, ranges_.all() - bounded);
    transfer.put(&parts_, from.parts, bounded, 0, kIndex);
    transfer.put(&local_, from.local, part_count, part_room_, ArrayIndex::equal);
  }

  /// Reserves memory for the sub-shapes of both objects. complete() must follow.
  SubShapeArrays reserve(const Transfer<Device>& transfer, const SubShapeBuffers& a,
                         const SubShapeBuffers& b) {
    const SubShapeRanges most = a.ranges_ + b.ranges_;
    const std::size_t all = most.all(), bounded = most.bounded();
    part_count_ = a.part_count_ + b.part_count_;
    part_room_ = a.part_room_;
    const PageLayout layout{.index = ArrayIndex::sub_shape};
    return {
        .bodies = transfer.room_to_grow(&bodies_, all, layout),
        .numbers = transfer.room_to_grow(&numbers_, all, layout),
        .bounds = transfer.room_to_grow(&bounds_, bounded, layout),
        .solids = transfer.room_to_grow(&solids_, bounded - most.spheres()),
        .walls = transfer.room_to_grow(&walls_, all - bounded),
        .parts = transfer.room_to_grow(&parts_, bounded, layout),
        .local = transfer.room_to_grow(&local_, std::max<std::size_t>(part_room_, part_count_))};
  }
  void complete(const SubShapeRanges& ranges) { ranges_ = ranges; }

  SubShapeView view() const {
    return {.ranges = ranges_,
            .bodies = bodies_.data(),
            .numbers = numbers_.data(),
            .all_bounds = bounds_.data(),
            .solids = solids_.data(),
            .walls = walls_.data(),
            .parts = parts_.data(),
            .local = local_.data()};
  }
  const SubShapeRanges& ranges() const { return ranges_; }
  std::uint32_t part_count() const { return part_count_; }
  /// Whether added and removed parts still fit into the memory reserved by upload().
  bool has_room() const { return part_count_ <= part_room_; }

 private:
  template <class T>
  using Buffer = typename Device::template Buffer<T>;

  Buffer<std::uint32_t> bodies_, numbers_, parts_;
  Buffer<SphereInstance> bounds_;
  Buffer<PosedSolid> solids_;
  Buffer<Wall> walls_;
  Buffer<Transform> local_;
  std::vector<PosedSolid> solids_on_device_;  ///< of upload(), until it is complete
  SubShapeRanges ranges_;
  std::uint32_t part_count_ = 0;  ///< size of local_, including parts of removed compounds
  std::size_t part_room_ = 0;
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
