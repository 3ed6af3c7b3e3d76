/// Copies of many arrays from a device to the host.
#pragma once

#include <cstddef>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

struct HostCopy {
  void* to = nullptr;          ///< memory of the host
  const void* from = nullptr;  ///< memory of the device
  std::size_t bytes = 0;
};
using HostCopies = std::vector<HostCopy>;

/// Adds a copy of as many items as `to` has.
template <class T, class Buffer>
void add_copy(HostCopies* copies, std::vector<T>* to, const Buffer& from) {
  copies->push_back({to->data(), from.data(), to->size() * sizeof(T)});
}

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
