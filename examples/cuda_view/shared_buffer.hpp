/// An OpenGL buffer that CUDA writes: directly if both use one device, otherwise through the host.
#pragma once

#include <jfpx/cuda/sphere_collider.hpp>

#include <cstddef>
#include <memory>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda_view {

/// Requires the OpenGL context of the buffer for its lifetime.
class SharedBuffer {
 public:
  /// @param buffer  name of an OpenGL buffer of that many bytes
  /// @param by_host copies through the host in any case
  /// @throws DeviceError, OutOfMemory
  SharedBuffer(unsigned buffer, std::size_t bytes, bool by_host);
  ~SharedBuffer();
  SharedBuffer(const SharedBuffer&) = delete;
  SharedBuffer& operator=(const SharedBuffer&) = delete;

  /// Device memory, valid in stream order until the next unmap().
  void* map(cuda::Stream stream);
  /// Completes the write, after which OpenGL may use the buffer.
  void unmap(cuda::Stream stream);
  /// Reason why the data is copied through the host; empty if it is not.
  const std::string& host_copy_reason() const { return host_copy_reason_; }

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  std::string host_copy_reason_;
};

}  // namespace cuda_view
}  // namespace JFPX_ABI
}  // namespace jfpx
