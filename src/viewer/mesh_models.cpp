/// Triangle meshes in GPU memory.
#include "src/viewer/mesh_models.hpp"

#include "src/viewer/mesh_geometry.hpp"

#include <cstddef>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

struct Attribute {
  GLint components;
  GLenum type;
  std::size_t offset;
};
constexpr Attribute kVertexAttributes[] = {{3, GL_FLOAT, offsetof(MeshVertex, position)},
                                           {4, GL_SHORT, offsetof(MeshVertex, normal)},
                                           {3, GL_SHORT, offsetof(MeshVertex, face)}};
constexpr Attribute kItemAttributes[] = {{3, GL_FLOAT, offsetof(MeshItem, centre)},
                                         {4, GL_FLOAT, offsetof(MeshItem, turn)},
                                         {4, GL_UNSIGNED_BYTE, offsetof(MeshItem, paint)},
                                         {4, GL_FLOAT, offsetof(MeshItem, phase)}};

/// Sets an attribute from the bound buffer. Integers are normalized.
void set_attribute(GLuint location, const Attribute& attribute, std::size_t stride,
                   GLuint divisor) {
  glEnableVertexAttribArray(location);
  // NOLINTNEXTLINE(performance-no-int-to-ptr): OpenGL passes offsets as pointers
  const auto* offset = reinterpret_cast<const void*>(attribute.offset);
  glVertexAttribPointer(location, attribute.components, attribute.type,
                        attribute.type == GL_FLOAT ? GL_FALSE : GL_TRUE,
                        static_cast<GLsizei>(stride), offset);
  glVertexAttribDivisor(location, divisor);
}

template <class T>
void fill(GLenum target, const GlBuffer& buffer, const std::vector<T>& data, GLenum usage) {
  glBindBuffer(target, buffer.name());
  glBufferData(target, static_cast<GLsizeiptr>(data.size() * sizeof(T)), data.data(), usage);
}

}  // namespace

MeshModel::MeshModel(const TriangleMesh& mesh)
    : data_(mesh.data()),
      vertices_(make_buffer()),
      indices_(make_buffer()),
      instances_(make_buffer()),
      array_(make_vertex_array()) {
  const MeshGeometry geometry = make_geometry(mesh);
  index_count_ = static_cast<GLsizei>(geometry.indices.size());
  glBindVertexArray(array_.name());
  fill(GL_ARRAY_BUFFER, vertices_, geometry.vertices, GL_STATIC_DRAW);
  GLuint location = 0;
  for (const Attribute& attribute : kVertexAttributes) {
    set_attribute(location++, attribute, sizeof(MeshVertex), 0);
  }
  glBindBuffer(GL_ARRAY_BUFFER, instances_.name());
  for (const Attribute& attribute : kItemAttributes) {
    set_attribute(location++, attribute, sizeof(MeshItem), 1);
  }
  fill(GL_ELEMENT_ARRAY_BUFFER, indices_, geometry.indices, GL_STATIC_DRAW);
}

void MeshModel::upload() { fill(GL_ARRAY_BUFFER, instances_, items_, GL_STREAM_DRAW); }

void MeshModel::draw() const {
  if (items_.empty()) return;
  glBindVertexArray(array_.name());
  glDrawElementsInstanced(GL_TRIANGLES, index_count_, GL_UNSIGNED_INT, nullptr,
                          static_cast<GLsizei>(items_.size()));
}

void MeshModels::upload(const std::vector<PlacedMesh>& meshes) {
  // Precedes the search, because the address of a mesh can be that of an earlier one.
  std::erase_if(models_, [](const auto& entry) { return entry.second.is_orphaned(); });
  for (auto& [data, model] : models_) model.clear();
  for (const PlacedMesh& placed : meshes) {
    models_.try_emplace(placed.mesh.data().get(), placed.mesh).first->second.add(placed.item);
  }
  for (auto& [data, model] : models_) model.upload();
}

void MeshModels::draw() const {
  for (const auto& [data, model] : models_) model.draw();
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
