/// Triangle meshes in GPU memory.
#pragma once

#include "src/viewer/drawing.hpp"
#include "src/viewer/gl.hpp"

#include <cstddef>
#include <memory>
#include <unordered_map>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// The vertices of one mesh, and the bodies of a picture that have it.
class MeshModel {
 public:
  explicit MeshModel(const TriangleMesh& mesh);
  void clear() { items_.clear(); }
  void add(const MeshItem& item) { items_.push_back(item); }
  void upload();
  /// Draws all bodies in one call.
  void draw() const;
  /// Whether no body has the mesh any more.
  bool is_orphaned() const { return data_.expired(); }

 private:
  std::weak_ptr<const jfpx::detail::MeshData> data_;
  GlBuffer vertices_, indices_, instances_;
  GlVertexArray array_;
  GLsizei index_count_ = 0;
  std::vector<MeshItem> items_;
};

/// Uploads the vertices of a mesh when it is drawn first, and frees them when the mesh no longer
/// exists.
class MeshModels {
 public:
  void upload(const std::vector<PlacedMesh>& meshes);
  void draw() const;
  /// Number of meshes in GPU memory.
  std::size_t count() const { return models_.size(); }

 private:
  std::unordered_map<const jfpx::detail::MeshData*, MeshModel> models_;
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
