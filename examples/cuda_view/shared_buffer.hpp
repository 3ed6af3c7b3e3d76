/// An OpenGL buffer that CUDA writes: in place where both are one device, else by way of the host.
#pragma once

#include <jfpx/cuda/sphere_collider.hpp>

#include <cstddef>
#include <memory>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda_view {

/// Needs the OpenGL context of the buffer for its whole life.
class SharedBuffer {
 public:
  /// @param buffer  name of an OpenGL buffer of that many bytes
  /// @param by_host whether to go by way of the host in any case
  /// @throws DeviceError, OutOfMemory
  SharedBuffer(unsigned buffer, std::size_t bytes, bool by_host);
  ~SharedBuffer();
  SharedBuffer(const SharedBuffer&) = delete;
  SharedBuffer& operator=(const SharedBuffer&) = delete;

  /// Memory to write in the order of the stream, until the next unmap().
  void* map(cuda::Stream stream);
  /// What was written is in the buffer; OpenGL may use it.
  void unmap(cuda::Stream stream);
  /// Why bytes go by way of the host; empty if they do not.
  const std::string& detour() const { return detour_; }

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  std::string detour_;
};

}  // namespace cuda_view
}  // namespace JFPX_ABI
}  // namespace jfpx
