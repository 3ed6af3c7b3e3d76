/// Geometry of triangle meshes for drawing: vertices with normals, bounds, and distances.
#pragma once

#include <jfpx/math.hpp>
#include <jfpx/triangle_mesh.hpp>

#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// A vertex in the layout of the GPU buffer.
struct MeshVertex {
  float position[3];       ///< [m], relative to the centre of the mesh
  std::int16_t normal[3];  ///< in units of 1 / 32767
  std::int16_t one_sided;  ///< 32767 if its triangles are one-sided, otherwise 0
  std::int16_t face[3];    ///< normal of the triangles whose last vertex it is
  std::int16_t unused;     ///< instead of padding
};

/// Triangles with normals. A vertex has one normal for each group of its triangles that form a
/// smooth surface. Triangles without area, and duplicates, are left out; two triangles with the
/// same vertices and opposite fronts are one two-sided triangle.
struct MeshGeometry {
  std::vector<MeshVertex> vertices;
  /// Three for each triangle. The last one is the provoking vertex of flat attributes.
  std::vector<std::uint32_t> indices;
};
/// Takes O(n) time.
MeshGeometry make_geometry(const TriangleMesh& mesh);

/// Whether the mesh has a triangle with area.
bool has_surface(const TriangleMesh& mesh);
/// Bounds in body axes of a mesh that has a surface. Takes O(1) time.
Aabb bounds_of(const TriangleMesh& mesh);
/// Centre of the bounds; vertices are stored relative to it, to preserve precision far from the
/// origin.
Vec3 centre_of(const TriangleMesh& mesh);
/// Distance of a point in body axes from the nearest triangle [m]; kMaxReal without a surface.
Real distance_to(const TriangleMesh& mesh, const Vec3& point);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
