/// Copies between the host and the buffers of a device.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Copies between the host and the buffers of a device. The functions only enqueue work: what they
/// read or write on the host must stay until wait() returns. Counts the buffers that it moves.
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
  const T* put(Buffer<T>* to, const T* from, std::size_t count, std::size_t room = 0) const {
    reserve(to, std::max({count, room, std::size_t{1}}), "the bodies of a world");
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
  /// Makes room for `count` items, which discards the contents. @returns the address
  template <class T>
  T* room(Buffer<T>* buffer, std::size_t count) const {
    reserve(buffer, std::max<std::size_t>(count, 1), "a step of a world");
    return buffer->data();
  }
  /// The same for a count that has slack already.
  template <class T>
  T* exact_room(Buffer<T>* buffer, std::size_t count) const {
    const T* const before = buffer->data();
    device_->reserve_exactly(buffer, std::max<std::size_t>(count, 1), "a step of a world");
    if (buffer->data() != before) ++moves_;
    return buffer->data();
  }
  template <class T>
  void copy(T* to, const T* from, std::size_t count) const {
    device_->copy(to, from, count);
  }
  void wait() const { device_->wait(); }
  /// Changes whenever an array gets another address.
  std::uint64_t moves() const { return moves_; }

 private:
  template <class T>
  void reserve(Buffer<T>* buffer, std::size_t count, const char* what) const {
    const T* const before = buffer->data();
    device_->reserve(buffer, count, what);
    if (buffer->data() != before) ++moves_;
  }

  Device* device_;
  mutable std::uint64_t moves_ = 0;
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
