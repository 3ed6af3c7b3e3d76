/// Spheres in device memory that are drawn in addition to the items of a Drawing.
#pragma once

#include <jfpx/cuda/sphere_collider.hpp>

#include "src/viewer/drawing.hpp"
#include "src/viewer/gl.hpp"

#include <memory>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// A buffer of OpenGL that a device writes. Requires the context of the buffer for its lifetime.
class SharedBuffer {
 public:
  virtual ~SharedBuffer() = default;
  /// Returns device memory, valid in the order of the stream until the next unmap().
  virtual void* map(cuda::Stream stream) = 0;
  /// Completes the write; OpenGL may then use the buffer.
  virtual void unmap(cuda::Stream stream) = 0;
};

class ResidentSpheres {
 public:
  virtual ~ResidentSpheres() = default;
  virtual std::size_t count() const = 0;
  /// Shares an OpenGL buffer of count() items with the device. The result may be used for other
  /// spheres of the same number.
  virtual std::unique_ptr<SharedBuffer> share(GLuint buffer) = 0;
  /// Writes all items, relative to the eye.
  virtual void write(SharedBuffer* buffer, const Vec3& eye) = 0;
  /// Reason why the items are copied through the host; otherwise empty. Valid after share().
  virtual const std::string& host_copy_reason() const = 0;
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
