/// Rays, moving solids, distances and their results, for the queries of a World.
#pragma once

#include <jfpx/body.hpp>

#include <cstdint>
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
  /// Number of the part in Compound::parts, of the triangle in TriangleMesh::triangles() or, as in
  /// HeightfieldDef, of the triangle of a heightfield; 0 for other shapes.
  std::uint32_t part = 0;
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
  Real fraction = 0;       ///< [-], of the translation, in [0, 1]
  Vec3 point;              ///< [m], world
  Vec3 normal;             ///< [-], unit, from the body to the solid
  Real distance = 0;       ///< [m], <= 0: negative depth of an overlap at the start
  std::uint32_t part = 0;  ///< of the body, as in RayHit
  friend bool operator==(const ShapeHit&, const ShapeHit&) = default;
};

/// A point or a solid whose distances from bodies are asked for.
struct DistanceQuery {
  Vec3 position = {};            ///< [m], of the origin of the shape, within kMaxCoordinate
  SolidShape shape = Sphere{0};  ///< a sphere of radius 0 is a point
  Quat orientation = {};         ///< unit quaternion
  Real max_distance = std::numeric_limits<Real>::infinity();  ///< [m], >= 0
};

/// The closest points of a body and a solid, so that query_point = point + normal * distance.
struct BodyDistance {
  BodyId body;
  Real distance = 0;       ///< [m]; of an overlap < 0: negative depth
  Vec3 point;              ///< [m], world, of the surface of the body
  Vec3 query_point;        ///< [m], world, of the surface of the solid
  Vec3 normal;             ///< [-], unit, from the body to the solid
  std::uint32_t part = 0;  ///< of the body, as in RayHit
  friend bool operator==(const BodyDistance&, const BodyDistance&) = default;
};

/// Predicate that selects bodies; empty selects all. A query calls it for bodies that it hits, at
/// most once for each, in unspecified order.
using BodyFilter = std::function<bool(BodyId)>;

}  // namespace JFPX_ABI
}  // namespace jfpx
