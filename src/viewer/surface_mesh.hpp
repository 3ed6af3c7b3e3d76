/// Surfaces of hulls as triangle meshes.
#pragma once

#include <jfpx/hull.hpp>
#include <jfpx/triangle_mesh.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// The surface of a hull, for drawing. It is made once for all copies of the hull, and kept. Can be
/// called by several threads.
TriangleMesh mesh_of(const Hull& hull);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
