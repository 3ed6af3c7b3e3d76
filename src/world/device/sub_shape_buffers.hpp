/// The sub-shapes of the bodies in the memory of a device.
#pragma once

#include "src/world/device/step_data.hpp"
#include "src/world/device/transfer.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

template <class Device>
class SubShapeBuffers {
 public:
  /// @param part_count number of parts of compounds
  void upload(const Transfer<Device>& transfer, const SubShapeView& from, std::size_t part_count,
              NearBounds* near) {
    SubShapeView& to = near->sub_shapes;
    to = from;
    const std::uint32_t boxes = from.bounded_count - from.sphere_count;
    to.bodies = transfer.put(&bodies_, from.bodies, from.count);
    to.numbers = transfer.put(&numbers_, from.numbers, from.count);
    transfer.put(&bounds_, from.all_bounds, from.bounded_count);
    transfer.put(&boxes_, from.boxes, boxes);
    to.all_bounds = bounds_.data();
    to.boxes = boxes_.data();
    to.walls = transfer.put(&walls_, from.walls, from.count - from.bounded_count);
    to.parts = transfer.put(&parts_, from.parts, from.bounded_count);
    to.local = transfer.put(&local_, from.local, part_count);
    near->margins = transfer.room(&margins_, from.bounded_count);
    near->swept = transfer.room(&swept_, from.bounded_count);
  }

 private:
  template <class T>
  using Buffer = typename Device::template Buffer<T>;

  Buffer<std::uint32_t> bodies_, numbers_, parts_;
  Buffer<SphereInstance> bounds_, swept_;
  Buffer<PosedBox> boxes_;
  Buffer<Wall> walls_;
  Buffer<Transform> local_;
  Buffer<Real> margins_;
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
