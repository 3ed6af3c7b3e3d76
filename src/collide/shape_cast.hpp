/// Casts of solids: the first contact of a convex solid that moves along a line without turning.
#pragma once

#include "src/collide/convex_core.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// A straight motion, and how much of it is of interest.
struct LinearMotion {
  Vec3 direction;   ///< unit, or zero for no motion
  Real length = 0;  ///< [m]
  Real limit = 1;   ///< [-], fraction of the motion after which contacts do not count
};

/// The first contact of a moving shape.
struct CastEntry {
  bool hit = false;
  /// Whether the cores overlap at the start, by more than the rounding errors. The normal is then
  /// an axis along which they overlap little, and the fraction is 0.
  bool is_inside = false;
  Real fraction = 0;       ///< [-], of the motion, in [0, 1]
  Vec3 point;              ///< [m]
  Vec3 normal;             ///< unit, from the target to the moving shape
  std::uint32_t part = 0;  ///< as in ShapeHit
};

/// Casts a shape to a target, in the axes of the target. A shape that touches the target at the
/// start hits it only if it moves towards it.
/// @param rotation axes of the moving shape, as columns
/// @param offset   [m], of the moving shape at the start
CastEntry cast(const ConvexCore& target, const ConvexCore& moving, const Mat3& rotation,
               const Vec3& offset, const LinearMotion& motion);

/// Casts a shape to a half-space, in world axes. A shape that touches the half-space at the start
/// hits it only if it moves towards it.
CastEntry cast(const HalfSpace& target, const ConvexCore& moving, const Transform& pose,
               const LinearMotion& motion);

/// Casts a solid to the triangles of a mesh, in world axes. A one-sided triangle is hit if the
/// centre starts in front of it. Triangles whose insides the solid overlaps at the start are left
/// out. Of triangles at the same fraction, the one with the lowest number is hit.
/// @param half_extents [m], of the solid in the axes of the mesh
CastEntry cast(const MeshView& mesh, const Transform& mesh_pose, const ConvexCore& moving,
               const Transform& pose, const Vec3& half_extents, const LinearMotion& motion);

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
