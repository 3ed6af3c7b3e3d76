/// Rays, moving solids and their hits, for the queries of a World.
#pragma once

#include <jfpx/body.hpp>

#include <functional>
#include <limits>

namespace jfpx {
inline namespace JFPX_ABI {

/// A half-line or a segment.
struct Ray {
  Vec3 origin;              ///< [m], within kMaxCoordinate
  Vec3 direction{0, 0, 1};  ///< finite and not zero; of any length
  Real max_distance = std::numeric_limits<Real>::infinity();  ///< [m], >= 0
};

/// Point where a ray enters a body. If the ray starts in a body or on its surface, the distance is
/// 0 and the normal is opposite to the ray. All numbers are finite: an intersection with a wall at
/// a distance beyond the range of Real is not a hit.
struct RayHit {
  BodyId body;
  Real distance = 0;  ///< [m], from the origin
  Vec3 point;         ///< [m], world
  Vec3 normal;        ///< [-], unit, outwards
  friend bool operator==(const RayHit&, const RayHit&) = default;
};

/// A solid that moves along a straight line without turning.
struct ShapeCast {
  SolidShape shape = Sphere{};
  Vec3 position = {};     ///< [m], of the origin of the shape at the start, within kMaxCoordinate
  Quat orientation = {};  ///< unit quaternion
  Vec3 translation = {};  ///< [m]; the end is within kMaxCoordinate, too; zero is allowed
};

/// Where a moving solid first touches a body. A solid that overlaps the body at the start, so that
/// World::overlapping() finds the body, has the fraction 0, and the point, the normal and the
/// distance of the deepest contact: moving the solid by -distance along the normal ends this
/// contact. In all other cases the distance is 0.
struct ShapeHit {
  BodyId body;
  Real fraction = 0;  ///< [-], of the translation, in [0, 1]
  Vec3 point;         ///< [m], world
  Vec3 normal;        ///< [-], unit, from the body to the solid
  Real distance = 0;  ///< [m], <= 0: negative depth of an overlap at the start
  friend bool operator==(const ShapeHit&, const ShapeHit&) = default;
};

/// Predicate that selects bodies; empty selects all. A query calls it for bodies that it hits, at
/// most once for each, in unspecified order.
using BodyFilter = std::function<bool(BodyId)>;

}  // namespace JFPX_ABI
}  // namespace jfpx
