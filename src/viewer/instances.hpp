/// Instance buffers: all spheres, boxes or lines of a picture in one draw call each.
#pragma once

#include "src/viewer/drawing.hpp"
#include "src/viewer/gl.hpp"

#include <span>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// A vertex array over one buffer of items that advance once an instance.
class Instances {
 public:
  /// Where a field of an item lies. Bytes are read as numbers from 0 to 1.
  struct Field {
    int components;
    GLenum type;
    std::size_t offset;
  };
  Instances(std::span<const Field> fields, std::size_t stride, GLenum mode, int vertices);
  void upload_bytes(const void* data, std::size_t items);
  /// Room for so many items, which somebody else fills. @return the buffer
  GLuint reserve(std::size_t items);
  void draw() const { draw(static_cast<std::size_t>(count_)); }
  /// Only the first ones.
  void draw(std::size_t items) const;

 private:
  GlBuffer buffer_;
  GlVertexArray array_;
  std::size_t stride_;
  GLenum mode_;
  int vertices_;
  GLsizei count_ = 0;
};

class SphereInstances : public Instances {
 public:
  SphereInstances();
  void upload(const std::vector<SphereItem>& items) { upload_bytes(items.data(), items.size()); }
};
class BoxInstances : public Instances {
 public:
  BoxInstances();
  void upload(const std::vector<BoxItem>& items) { upload_bytes(items.data(), items.size()); }
};
class LineInstances : public Instances {
 public:
  LineInstances();
  void upload(const std::vector<LineItem>& items) { upload_bytes(items.data(), items.size()); }
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
