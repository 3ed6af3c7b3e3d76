/// An OpenGL buffer that CUDA writes, directly on the same device and otherwise through the host.
#pragma once

#include "src/viewer/resident_spheres.hpp"

#include <cstddef>
#include <memory>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

class CudaSharedBuffer final : public SharedBuffer {
 public:
  /// @param buffer name of an OpenGL buffer of `bytes` bytes
  /// @throws DeviceError, OutOfMemory
  CudaSharedBuffer(GLuint buffer, std::size_t bytes);
  ~CudaSharedBuffer() override;

  void* map(cuda::Stream stream) override;
  void unmap(cuda::Stream stream) override;
  /// Reason why the data is copied through the host; empty if it is written directly.
  const std::string& host_copy_reason() const { return host_copy_reason_; }

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  std::string host_copy_reason_;
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
