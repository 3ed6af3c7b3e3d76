/// The classes of concave shapes whose triangles are known.
#include "src/bullet/dispatch/concave_triangles.hpp"

#include "src/bullet/exact_class.hpp"

#include <BulletCollision/CollisionShapes/btTriangleIndexVertexMaterialArray.h>
#include <BulletCollision/CollisionShapes/btTriangleMesh.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

bool is_known_mesh(const btCollisionShape& shape) {
  if (!is_exactly<btBvhTriangleMeshShape>(shape)) return false;
  const auto& mesh = static_cast<const btBvhTriangleMeshShape&>(shape);
  const btStridingMeshInterface* arrays = mesh.getMeshInterface();
  return tree_of(mesh) != nullptr && arrays != nullptr &&
         (is_exactly<btTriangleIndexVertexArray>(*arrays) || is_exactly<btTriangleMesh>(*arrays) ||
          is_exactly<btTriangleIndexVertexMaterialArray>(*arrays));
}

/// Whether a box can be divided by the scaling.
bool is_regular(const btVector3& scaling) {
  const auto is_regular_factor = [](btScalar x) {
    return btFabs(x) > btScalar(1e-8) && btFabs(x) < btScalar(1e8);
  };
  return is_regular_factor(scaling.x()) && is_regular_factor(scaling.y()) &&
         is_regular_factor(scaling.z());
}

}  // namespace

bool has_known_triangles(const btCollisionShape& shape) {
  switch (shape.getShapeType()) {
    case TRIANGLE_MESH_SHAPE_PROXYTYPE:
      return is_known_mesh(shape);
    case SCALED_TRIANGLE_MESH_SHAPE_PROXYTYPE:
      return is_exactly<btScaledBvhTriangleMeshShape>(shape) &&
             is_regular(static_cast<const btScaledBvhTriangleMeshShape&>(shape)
                            .btScaledBvhTriangleMeshShape::getLocalScaling()) &&
             is_known_mesh(
                 *static_cast<const btScaledBvhTriangleMeshShape&>(shape).getChildShape());
    case TERRAIN_SHAPE_PROXYTYPE:
      return is_exactly<btHeightfieldTerrainShape>(shape) &&
             is_regular(static_cast<const btHeightfieldTerrainShape&>(shape).*
                        HeightFields::scaling);
    default:
      return false;
  }
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
