/// Instance buffers, which draw all spheres, boxes or lines of a picture in one call each.
#include "src/viewer/instances.hpp"

#include <cstddef>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

using Field = Instances::Field;
constexpr Field kSphereFields[] = {{4, GL_FLOAT, offsetof(SphereItem, centre)},
                                   {4, GL_FLOAT, offsetof(SphereItem, turn)},
                                   {4, GL_UNSIGNED_BYTE, offsetof(SphereItem, paint)}};
constexpr Field kBoxFields[] = {{3, GL_FLOAT, offsetof(BoxItem, centre)},
                                {3, GL_FLOAT, offsetof(BoxItem, half_extents)},
                                {4, GL_FLOAT, offsetof(BoxItem, turn)},
                                {4, GL_UNSIGNED_BYTE, offsetof(BoxItem, paint)}};
constexpr Field kRoundedFields[] = {{3, GL_FLOAT, offsetof(RoundedItem, box.centre)},
                                    {3, GL_FLOAT, offsetof(RoundedItem, box.half_extents)},
                                    {4, GL_FLOAT, offsetof(RoundedItem, box.turn)},
                                    {4, GL_UNSIGNED_BYTE, offsetof(RoundedItem, box.paint)},
                                    {1, GL_FLOAT, offsetof(RoundedItem, radius)}};
constexpr Field kLineFields[] = {{3, GL_FLOAT, offsetof(LineItem, from)},
                                 {3, GL_FLOAT, offsetof(LineItem, to)},
                                 {4, GL_UNSIGNED_BYTE, offsetof(LineItem, rgba)},
                                 {1, GL_FLOAT, offsetof(LineItem, width)}};

}  // namespace

Instances::Instances(std::span<const Field> fields, std::size_t stride, GLenum mode, int vertices)
    : buffer_(make_buffer()),
      array_(make_vertex_array()),
      stride_(stride),
      mode_(mode),
      vertices_(vertices) {
  glBindVertexArray(array_.name());
  glBindBuffer(GL_ARRAY_BUFFER, buffer_.name());
  GLuint location = 0;
  for (const Field& field : fields) {
    glEnableVertexAttribArray(location);
    // NOLINTNEXTLINE(performance-no-int-to-ptr): OpenGL passes offsets as pointers
    const auto* offset = reinterpret_cast<const void*>(field.offset);
    glVertexAttribPointer(location, field.components, field.type,
                          field.type == GL_UNSIGNED_BYTE ? GL_TRUE : GL_FALSE,
                          static_cast<GLsizei>(stride), offset);
    glVertexAttribDivisor(location, 1);
    ++location;
  }
}

void Instances::upload_bytes(const void* data, std::size_t items) {
  glBindBuffer(GL_ARRAY_BUFFER, buffer_.name());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(items * stride_), data, GL_STREAM_DRAW);
  count_ = static_cast<GLsizei>(items);
}

GLuint Instances::reserve(std::size_t items) {
  upload_bytes(nullptr, items);
  return buffer_.name();
}

void Instances::draw(std::size_t items) const {
  if (items == 0) return;
  glBindVertexArray(array_.name());
  glDrawArraysInstanced(mode_, 0, vertices_, static_cast<GLsizei>(items));
}

SphereInstances::SphereInstances()
    : Instances(kSphereFields, sizeof(SphereItem), GL_TRIANGLE_STRIP, 4) {}
BoxInstances::BoxInstances() : Instances(kBoxFields, sizeof(BoxItem), GL_TRIANGLES, 36) {}
RoundedInstances::RoundedInstances()
    : Instances(kRoundedFields, sizeof(RoundedItem), GL_TRIANGLES, 36) {}
LineInstances::LineInstances() : Instances(kLineFields, sizeof(LineItem), GL_TRIANGLE_STRIP, 4) {}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
