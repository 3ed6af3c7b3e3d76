/// Access to protected members of Bullet's concave shapes and their trees.
#pragma once

#include <jfpx/config.hpp>

#include <BulletCollision/BroadphaseCollision/btQuantizedBvh.h>
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btOptimizedBvh.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

struct BvhFields : btQuantizedBvh {
  static constexpr auto node_count = &BvhFields::m_curNodeIndex;
  static constexpr auto nodes = &BvhFields::m_quantizedContiguousNodes;
  static constexpr auto traversal_mode = &BvhFields::m_traversalMode;
  static constexpr auto is_quantized = &BvhFields::m_useQuantization;
};

/// Bullet declares this function non-const, although it only returns the tree.
inline const btQuantizedBvh* tree_of(const btBvhTriangleMeshShape& mesh) {
  return const_cast<btBvhTriangleMeshShape&>(mesh).getOptimizedBvh();
}

struct HeightFields : btHeightfieldTerrainShape {
  static constexpr auto local_min = &HeightFields::m_localAabbMin;
  static constexpr auto local_max = &HeightFields::m_localAabbMax;
  static constexpr auto origin = &HeightFields::m_localOrigin;
  static constexpr auto columns = &HeightFields::m_heightStickWidth;
  static constexpr auto rows = &HeightFields::m_heightStickLength;
  static constexpr auto width = &HeightFields::m_width;
  static constexpr auto length = &HeightFields::m_length;
  static constexpr auto height_scale = &HeightFields::m_heightScale;
  static constexpr auto bytes = &HeightFields::m_heightfieldDataUnsignedChar;
  static constexpr auto shorts = &HeightFields::m_heightfieldDataShort;
  static constexpr auto floats = &HeightFields::m_heightfieldDataFloat;
  static constexpr auto doubles = &HeightFields::m_heightfieldDataDouble;
  static constexpr auto type = &HeightFields::m_heightDataType;
  static constexpr auto flips_edges = &HeightFields::m_flipQuadEdges;
  static constexpr auto diamonds = &HeightFields::m_useDiamondSubdivision;
  static constexpr auto zigzag = &HeightFields::m_useZigzagSubdivision;
  static constexpr auto flips_winding = &HeightFields::m_flipTriangleWinding;
  static constexpr auto up = &HeightFields::m_upAxis;
  static constexpr auto scaling = &HeightFields::m_localScaling;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
