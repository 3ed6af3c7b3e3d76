/// Instance buffers, which draw all spheres, boxes or lines of a picture in one call each.
#pragma once

#include "src/viewer/drawing.hpp"
#include "src/viewer/gl.hpp"

#include <span>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// A vertex array over one buffer of items, which advances by one item per instance.
class Instances {
 public:
  /// Location of a field in an item. Bytes are normalized to [0, 1].
  struct Field {
    int components;
    GLenum type;
    std::size_t offset;
  };
  Instances(std::span<const Field> fields, std::size_t stride, GLenum mode, int vertices);
  void upload_bytes(const void* data, std::size_t items);
  /// Allocates memory for items that the caller writes. @return the buffer
  GLuint reserve(std::size_t items);
  std::size_t count() const { return static_cast<std::size_t>(count_); }
  void draw() const { draw(count()); }
  /// Draws the first `items` items.
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
class RoundedInstances : public Instances {
 public:
  RoundedInstances();
  void upload(const std::vector<RoundedItem>& items) { upload_bytes(items.data(), items.size()); }
};
class LineInstances : public Instances {
 public:
  LineInstances();
  void upload(const std::vector<LineItem>& items) { upload_bytes(items.data(), items.size()); }
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
