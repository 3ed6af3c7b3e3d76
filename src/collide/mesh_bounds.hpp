/// Bounds and arrays of a triangle mesh or a heightfield as the shape of a body.
#pragma once

#include "src/collide/box_pair.hpp"
#include "src/collide/heightfield_data.hpp"
#include "src/collide/mesh_data.hpp"
#include "src/collide/solid.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// A TriangleMesh or a Heightfield.
template <class S>
concept Mesh = kIsMesh<S>;

inline MeshView view_of(const Mesh auto& mesh) {
  return mesh.data() == nullptr ? MeshView{} : mesh.data()->view();
}
/// A box about the origin of the body that encloses the mesh.
inline Solid enclosing_box(const Mesh auto& mesh) {
  return {mesh.data() == nullptr ? Vec3{} : mesh.data()->half_extents, 0};
}
/// [m], from the origin of the body.
inline Real outer_radius(const Mesh auto& mesh) { return length(enclosing_box(mesh).half_extents); }
inline Real bounding_radius(const Mesh auto& mesh) {
  return outer_radius(mesh) * (1 + 64 * kEpsilon);
}
inline Vec3 half_extents(const Mesh auto& mesh, const Transform& pose) {
  const Vec3 half = enclosing_box(mesh).half_extents;
  return {projected_half_length(half, pose.basis.row[0]),
          projected_half_length(half, pose.basis.row[1]),
          projected_half_length(half, pose.basis.row[2])};
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
