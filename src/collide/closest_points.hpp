/// The closest points of a convex solid and another shape.
#pragma once

#include "src/collide/convex_core.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// The closest points of two shapes, if their distance is at most a limit.
struct ClosestPair {
  bool found = false;
  /// Whether the cores overlap or touch. Moving the solid by -distance along the normal then ends
  /// the overlap, but it may be that a shorter motion along another axis does, too.
  bool is_inside = false;
  Real distance = 0;       ///< [m]; of an overlap < 0: negative depth
  Vec3 point;              ///< [m], of the target
  Vec3 normal;             ///< unit, from the target to the solid
  std::uint32_t part = 0;  ///< as in BodyDistance
};

/// The closest points of two convex shapes, in the axes of the target.
/// @param rotation axes of the solid, as columns
/// @param offset   [m], of the solid
/// @param limit    [m], >= 0; may be infinite
ClosestPair find_closest(const ConvexCore& target, const ConvexCore& solid, const Mat3& rotation,
                         const Vec3& offset, Real limit);

/// A solid with its core.
struct PlacedSolid {
  SolidShape shape;  ///< owns what the core refers to
  Transform pose;
  ConvexCore core;

  PlacedSolid(const SolidShape& solid, const Transform& at)
      : shape(solid),
        pose(at),
        core(std::visit([](const auto& s) { return make_core(s); }, shape)) {}
};

/// The closest points of two solids, in world axes. If the cores overlap, the axis of collide() is
/// used, unless that of find_closest() is better.
ClosestPair find_closest(const PlacedSolid& target, const PlacedSolid& solid, Real limit);

/// The closest points of a half-space and a solid, in world axes.
ClosestPair find_closest(const HalfSpace& target, const PlacedSolid& solid, Real limit);

/// The closest points of a solid and the triangles of a mesh, in world axes. A one-sided triangle
/// counts if the centre of the solid is in front of it. Of triangles at the same distance, the one
/// with the lowest number counts. If a triangle overlaps or touches the solid, the distance is 0.
/// @param half_extents [m], of the solid in the axes of the mesh
ClosestPair find_closest(const MeshView& mesh, const Transform& mesh_pose, const PlacedSolid& solid,
                         const Vec3& half_extents, Real limit);

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
