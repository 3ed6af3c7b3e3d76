/// The arrays of a triangle mesh for contact tests, in host memory or on a device.
#pragma once

#include "src/collide/block_tree.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Instead of a vertex.
inline constexpr std::uint32_t kNoVertex = 0xffffffffu;

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

  JFPX_HD bool is_flat(std::uint32_t edge) const { return (flat_edges >> edge & 1) != 0; }
};

/// A mesh. Vertices at the same position are one vertex.
struct MeshView {
  const Vec3* vertices = nullptr;  ///< [m], body axes
  const MeshTriangle* triangles = nullptr;
  const std::uint32_t* first_neighbor = nullptr;  ///< by vertex, and the end: index in `neighbors`
  const std::uint32_t* neighbors = nullptr;       ///< vertices at the other ends of edges
  BlockTreeView tree;                             ///< of the triangles with area
  std::uint32_t vertex_count = 0, triangle_count = 0, neighbor_count = 0;
  std::uint32_t two_sided = 0;
};

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
