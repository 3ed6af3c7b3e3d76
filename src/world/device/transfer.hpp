/// Copies between the host and the buffers of a device.
#pragma once

#include "src/base/page_layout.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Copies between the host and the buffers of a device. The functions only enqueue work: host
/// memory must stay valid until wait() returns. Counts reallocations.
/// @tparam Device as for DeviceStep
template <class Device>
class Transfer {
 public:
  template <class T>
  using Buffer = typename Device::template Buffer<T>;

  explicit Transfer(Device* device) : device_(device) {}

  /// Copies an array to the device. @returns its address there
  /// @param room number of items to reserve memory for, if it is above `count`
  template <class T>
  const T* put(Buffer<T>* to, const T* from, std::size_t count, std::size_t room = 0,
               ArrayIndex index = ArrayIndex::slot) const {
    note_move(to, [&] {
      device_->reserve(to, std::max({count, room, std::size_t{1}}), "the bodies of a world",
                       {.index = index});
    });
    device_->upload(to->data(), from, count);
    return to->data();
  }
  template <class T>
  T* put(Buffer<T>* to, const std::vector<T>& from, std::size_t room = 0) const {
    put(to, from.data(), from.size(), room);
    return to->data();
  }
  /// Copies as many items as `to` has.
  template <class T>
  void get(std::vector<T>* to, const Buffer<T>& from) const {
    device_->download(to->data(), from.data(), to->size());
  }
  /// Copies items from any address on the device, and waits.
  template <class T>
  void read(const T* from, std::size_t count, T* to) const {
    if (count == 0) return;
    device_->download(to, from, count);
    device_->wait();
  }
  /// Reserves `count` items and discards the contents. @returns the address
  /// @param layout if several devices share the array
  template <class T>
  T* room(Buffer<T>* buffer, std::size_t count, const PageLayout& layout = {}) const {
    note_move(buffer, [&] {
      device_->reserve_exactly(buffer, std::max<std::size_t>(count, 1), "a step of a world",
                               layout);
    });
    return buffer->data();
  }
  /// Largest number of devices that share an array.
  std::uint32_t parts() const { return device_->parts(); }
  /// reserve() for a count that may grow slightly from call to call.
  template <class T>
  T* room_to_grow(Buffer<T>* buffer, std::size_t count, const PageLayout& layout = {}) const {
    note_move(buffer, [&] {
      device_->reserve(buffer, std::max<std::size_t>(count, 1), "a step of a world", layout);
    });
    return buffer->data();
  }
  template <class T>
  void copy(T* to, const T* from, std::size_t count) const {
    device_->copy(to, from, count);
  }
  void wait() const { device_->wait(); }
  /// Version number that changes whenever an array is reallocated.
  std::uint64_t moves() const { return moves_; }

 private:
  /// Calls reserve() and counts a reallocation.
  template <class T, class Reserve>
  void note_move(Buffer<T>* buffer, const Reserve& reserve) const {
    const T* const before = buffer->data();
    reserve();
    if (buffer->data() != before) ++moves_;
  }

  Device* device_;
  mutable std::uint64_t moves_ = 0;
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
