/// The data that copies of a TriangleMesh share.
#pragma once

#include <jfpx/triangle_mesh.hpp>

#include "src/collide/mesh_view.hpp"

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Immutable once made.
struct MeshData {
  TriangleMeshDef def;
  TriangleMeshReport report;
  Vec3 half_extents;  ///< [m], of a box about the origin that encloses the triangles
  std::vector<MeshTriangle> triangles;
  std::vector<std::uint32_t> first_neighbor, neighbors;
  BlockTree tree;

  /// Valid as long as the object.
  MeshView view() const {
    return {.vertices = def.vertices.data(),
            .triangles = triangles.data(),
            .first_neighbor = first_neighbor.data(),
            .neighbors = neighbors.data(),
            .tree = tree.view(),
            .grid = {},
            .vertex_count = static_cast<std::uint32_t>(def.vertices.size()),
            .triangle_count = static_cast<std::uint32_t>(triangles.size()),
            .neighbor_count = static_cast<std::uint32_t>(neighbors.size()),
            .two_sided = def.two_sided ? 1u : 0u};
  }
};

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
