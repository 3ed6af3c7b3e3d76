/// The forces of a world in the memory of a device.
#pragma once

#include "src/world/device/force_program.hpp"
#include "src/world/device/hull_buffers.hpp"
#include "src/world/device/transfer.hpp"
#include "src/world/forces/force_table.hpp"

#include <cstdint>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

template <class Device>
class ForceBuffers {
 public:
  /// Copies the changes since the last call. @returns whether the lists have changed
  bool upload(const Transfer<Device>& transfer, const ForceTable& table,
              HullBuffers<Device>* hulls) {
    const ForceView from = table.view();
    const bool has_new_lists = lists_version_ != table.lists_version();
    if (parameters_version_ != table.parameters_version()) put_parameters(transfer, from);
    if (has_new_lists) put_lists(transfer, from, hulls);
    parameters_version_ = table.parameters_version();
    lists_version_ = table.lists_version();
    return has_new_lists;
  }
  /// Whether upload() would copy nothing.
  bool has(const ForceTable& table) const {
    return parameters_version_ == table.parameters_version() &&
           lists_version_ == table.lists_version();
  }
  /// The next upload() copies everything.
  void clear() { parameters_version_ = lists_version_ = 0; }

  const ForceView& view() const { return view_; }
  /// Sums of the forces on each body in a step.
  Vec3* force_sums(const Transfer<Device>& transfer, std::size_t bodies) {
    return transfer.room_to_grow(&force_sum_, bodies);
  }
  Vec3* torque_sums(const Transfer<Device>& transfer, std::size_t bodies) {
    return transfer.room_to_grow(&torque_sum_, bodies);
  }

 private:
  template <class T>
  using Buffer = typename Device::template Buffer<T>;
  template <class... F>
  static std::tuple<Buffer<F>...> buffers_of(const std::variant<F...>&);

  template <class... F>
  void put_parameters(const Transfer<Device>& transfer,
                      const ForceArrays<std::variant<F...>>& from) {
    ((static_cast<ForceArray<F>&>(view_) = {transfer.put(&std::get<Buffer<F>>(parameters_),
                                                         from.template array<F>().forces,
                                                         from.template array<F>().count),
                                            from.template array<F>().count}),
     ...);
  }
  void put_lists(const Transfer<Device>& transfer, const ForceView& from,
                 HullBuffers<Device>* hulls) {
    view_.on_all_count = from.on_all_count;
    view_.on_all = transfer.put(&on_all_, from.on_all, from.on_all_count);
    view_.on_body = transfer.put(&on_body_, from.on_body, from.on_body_count);
    view_.first_item = transfer.put(&first_item_, from.first_item, from.first_item_count);
    view_.mass = transfer.put(&mass_, from.mass, from.mass_count);
    view_.parts = transfer.put(
        &parts_, hulls->on_device(transfer, from.parts, from.part_count, &parts_on_device_),
        from.part_count);
    view_.first_part = transfer.put(&first_part_, from.first_part, from.first_part_count);
  }

  decltype(buffers_of(std::declval<RecordableForce>())) parameters_;
  Buffer<ForceItem> on_all_, on_body_;
  Buffer<std::uint32_t> first_item_, first_part_;
  Buffer<Real> mass_;
  Buffer<SolidPart> parts_;
  std::vector<SolidPart> parts_on_device_;  ///< of upload(), until it is complete
  Buffer<Vec3> force_sum_, torque_sum_;
  ForceView view_;
  std::uint64_t parameters_version_ = 0, lists_version_ = 0;  ///< of the table; 0: none
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
