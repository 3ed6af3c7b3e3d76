/// The triangles of a mesh or a heightfield for contact tests, in host memory or on a device.
#pragma once

#include "src/collide/block_tree.hpp"
#include "src/collide/grid_view.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// A triangle and its neighbors. Edge i connects the vertices i and (i + 1) % 3.
struct MeshTriangle {
  std::uint32_t vertices[3] = {};
  /// By edge: the third vertex of the neighbor; kNoVertex if not exactly two triangles share the
  /// edge.
  std::uint32_t opposite[3] = {kNoVertex, kNoVertex, kNoVertex};
  std::uint32_t flat_edges = 0;  ///< bit i: the neighbor at edge i is in the same plane
  std::uint32_t unused = 0;      ///< instead of padding
  Vec3 normal;                   ///< unit, of the front; zero if the triangle has no contacts

  JFPX_HD bool has_contacts() const { return length_squared(normal) > 0; }
};

/// The triangles of a mesh, whose vertices have different positions, or those of a heightfield,
/// which has a grid instead of the arrays.
struct MeshView {
  const Vec3* vertices = nullptr;  ///< [m], body axes
  const MeshTriangle* triangles = nullptr;
  const std::uint32_t* first_neighbor = nullptr;  ///< by vertex, and the end: index in `neighbors`
  const std::uint32_t* neighbors = nullptr;       ///< vertices at the other ends of edges
  /// Of the triangles with area; on the host, of the tiles of a grid.
  BlockTreeView tree;
  GridView grid;
  std::uint32_t vertex_count = 0, triangle_count = 0, neighbor_count = 0;
  std::uint32_t two_sided = 0;

  JFPX_HD bool is_grid() const { return grid.columns != 0; }
  JFPX_HD bool has_triangle(std::uint32_t triangle) const {
    return is_grid() ? grid.has_triangle(triangle) : triangles[triangle].has_contacts();
  }
  JFPX_HD Vec3 position(std::uint32_t vertex) const {
    return is_grid() ? grid.position(vertex) : vertices[vertex];
  }
  JFPX_HD std::uint32_t vertex(std::uint32_t triangle, int k) const {
    return is_grid() ? grid.vertex(triangle, k) : triangles[triangle].vertices[k];
  }
  JFPX_HD std::uint32_t opposite(std::uint32_t triangle, int edge) const {
    return is_grid() ? grid.opposite(triangle, edge) : triangles[triangle].opposite[edge];
  }
  JFPX_HD std::uint32_t flat_edges(std::uint32_t triangle) const {
    return is_grid() ? grid.flat_edges(triangle) : triangles[triangle].flat_edges;
  }
  JFPX_HD void get_corners(std::uint32_t triangle, Vec3 (&corner)[3]) const {
    if (is_grid()) return grid.get_corners(triangle, corner);
    for (int k = 0; k < 3; ++k) corner[k] = vertices[triangles[triangle].vertices[k]];
  }
  /// Unit, of the front. @param corner of the triangle
  JFPX_HD Vec3 normal(std::uint32_t triangle, const Vec3 (&corner)[3]) const {
    if (!is_grid()) return triangles[triangle].normal;
    return TriangleArea(corner[0], corner[1], corner[2]).unit_normal();
  }
  /// Calls visit(neighbor) with the neighbors of a vertex until it returns false.
  /// @returns whether all calls returned true
  template <class Visit>
  JFPX_HD bool all_neighbors(std::uint32_t vertex, const Visit& visit) const {
    if (is_grid()) return grid.all_neighbors(vertex, visit);
    const std::uint32_t end = first_neighbor[vertex + 1];
    for (std::uint32_t k = first_neighbor[vertex]; k < end; ++k) {
      if (!visit(neighbors[k])) return false;
    }
    return true;
  }
  /// Calls visit(triangle) for the triangles whose bounds overlap a box.
  template <class Visit>
  JFPX_HD void visit_overlapping(const Aabb& box, const Visit& visit) const {
    if (is_grid()) {
      grid.visit_overlapping(box, visit);
    } else {
      tree.visit_overlapping(box, visit);
    }
  }
};

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
