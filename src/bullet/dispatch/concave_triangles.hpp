/// Traversal of the triangles of Bullet's concave shapes, without virtual calls.
///
/// The order of the triangles, their vertices and their numbers equal those that
/// btConcaveShape::processAllTriangles of Bullet 3.24 passes to a btConvexTriangleCallback. The
/// triangles outside the box, which that callback ignores, are not visited.
#pragma once

#include <jfpx/config.hpp>

#include "src/bullet/dispatch/height_cells.hpp"
#include "src/bullet/dispatch/mesh_leaves.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Calls visit(vertices, part, index) for the triangles of a mesh that overlap the box.
/// `scaling` multiplies the vertices if it is not null.
template <class Visit>
void for_each_mesh_triangle(const btBvhTriangleMeshShape& mesh, const btVector3* scaling,
                            const LocalBox& box, const Visit& visit) {
  MeshVertices vertices(static_cast<const btTriangleIndexVertexArray&>(*mesh.getMeshInterface()));
  const LocalBox searched = scaling != nullptr ? divided(box, *scaling) : box;
  for_each_leaf(mesh, searched, [&](int part, int index) {
    btVector3 triangle[3];
    vertices.read(part, index, triangle);
    if (scaling != nullptr) {
      for (btVector3& vertex : triangle) vertex = vertex * *scaling;
    }
    if (TestTriangleAgainstAabb2(triangle, box.min, box.max)) visit(triangle, part, index);
  });
}

/// Calls visit(vertices, part, index) for the triangles of a shape that overlap the box.
/// has_known_triangles() must be true for the shape.
template <class Visit>
void for_each_triangle(const btCollisionShape& shape, const LocalBox& box, const Visit& visit) {
  switch (shape.getShapeType()) {
    case TRIANGLE_MESH_SHAPE_PROXYTYPE:
      return for_each_mesh_triangle(static_cast<const btBvhTriangleMeshShape&>(shape), nullptr, box,
                                    visit);
    case SCALED_TRIANGLE_MESH_SHAPE_PROXYTYPE: {
      const auto& scaled = static_cast<const btScaledBvhTriangleMeshShape&>(shape);
      const btVector3 scaling = scaled.btScaledBvhTriangleMeshShape::getLocalScaling();
      return for_each_mesh_triangle(*scaled.getChildShape(), &scaling, box, visit);
    }
    default:
      return HeightCells(static_cast<const btHeightfieldTerrainShape&>(shape))
          .for_each_triangle(box, visit);
  }
}

/// Whether the triangles of a shape can be read on any thread: the shape must be exactly a
/// btBvhTriangleMeshShape, btScaledBvhTriangleMeshShape or btHeightfieldTerrainShape, and the
/// arrays of a mesh must be in one of Bullet's classes, which do not lock them.
bool has_known_triangles(const btCollisionShape& shape);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
