/// Surfaces of shapes as triangle meshes.
#pragma once

#include <jfpx/shape.hpp>

#include "src/collide/round/frustum.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// The surface of a hull, for drawing. It is made once for all copies of the hull, and kept. Can be
/// called by several threads.
TriangleMesh mesh_of(const Hull& hull);
/// The surface of a cylinder or a cone, with a polygon of 32 sides for a circle. It is made once
/// for all solids of the same size, and kept. Can be called by several threads.
TriangleMesh mesh_of(const jfpx::detail::Frustum& frustum);
/// The triangles of a heightfield, which are made once for all copies and kept as long as these.
/// Can be called by several threads.
TriangleMesh mesh_of(const Heightfield& heightfield);
/// The mesh of a triangle mesh or a heightfield; without triangles for other shapes.
TriangleMesh mesh_of(const Shape& shape);
/// Whether a shape is a triangle mesh or a heightfield.
bool is_mesh(const Shape& shape);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
