/// The sub-shapes of the bodies in the memory of a device.
#pragma once

#include "src/world/device/merge_program.hpp"
#include "src/world/device/step_data.hpp"
#include "src/world/device/transfer.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

template <class Device>
class SubShapeBuffers {
 public:
  /// Copies sub-shapes to the device. @param part_count number of parts of compounds
  void upload(const Transfer<Device>& transfer, const SubShapeView& from, std::size_t part_count) {
    const std::uint32_t boxes = from.bounded_count - from.sphere_count;
    counts_ = counts_of(from);
    part_count_ = static_cast<std::uint32_t>(part_count);
    transfer.put(&bodies_, from.bodies, from.count);
    transfer.put(&numbers_, from.numbers, from.count);
    transfer.put(&bounds_, from.all_bounds, from.bounded_count);
    transfer.put(&boxes_, from.boxes, boxes);
    transfer.put(&walls_, from.walls, from.count - from.bounded_count);
    transfer.put(&parts_, from.parts, from.bounded_count);
    transfer.put(&local_, from.local, part_count);
  }

  /// Makes room for the sub-shapes of two objects. complete() must follow.
  SubShapeArrays reserve(const Transfer<Device>& transfer, const SubShapeBuffers& a,
                         const SubShapeBuffers& b) {
    const SubShapeCounts &x = a.counts_, &y = b.counts_;
    part_count_ = a.part_count_ + b.part_count_;
    const std::size_t all = x.all() + y.all(), bounded = x.bounded() + y.bounded();
    return {.bodies = transfer.room_to_grow(&bodies_, all),
            .numbers = transfer.room_to_grow(&numbers_, all),
            .bounds = transfer.room_to_grow(&bounds_, bounded),
            .boxes = transfer.room_to_grow(&boxes_, bounded - x.spheres - y.spheres),
            .walls = transfer.room_to_grow(&walls_, x.walls + y.walls),
            .parts = transfer.room_to_grow(&parts_, bounded),
            .local = transfer.room_to_grow(&local_, part_count_)};
  }
  void complete(const SubShapeCounts& counts) { counts_ = counts; }

  SubShapeView view() const {
    return {.sphere_count = counts_.spheres,
            .fixed_begin = counts_.fixed_begin(),
            .bounded_count = counts_.bounded(),
            .count = counts_.all(),
            .bodies = bodies_.data(),
            .numbers = numbers_.data(),
            .all_bounds = bounds_.data(),
            .boxes = boxes_.data(),
            .walls = walls_.data(),
            .parts = parts_.data(),
            .local = local_.data()};
  }
  const SubShapeCounts& counts() const { return counts_; }
  std::uint32_t part_count() const { return part_count_; }

 private:
  template <class T>
  using Buffer = typename Device::template Buffer<T>;

  Buffer<std::uint32_t> bodies_, numbers_, parts_;
  Buffer<SphereInstance> bounds_;
  Buffer<PosedBox> boxes_;
  Buffer<Wall> walls_;
  Buffer<Transform> local_;
  SubShapeCounts counts_;
  std::uint32_t part_count_ = 0;  ///< size of local_, with parts of compounds that were removed
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
