/// Closest points of a hull to points and segments.
#pragma once

#include "src/collide/pair_manifold.hpp"
#include "src/collide/polyhedron.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// The closest point of a hull to a point, in the axes of the hull.
struct HullPoint {
  Vec3 normal;        ///< unit, from the hull to the point
  Real distance = 0;  ///< [m]; < 0: depth below the nearest face
};

/// Whether the projection of a point onto the plane of a face is inside the face.
JFPX_HD inline bool is_above_face(const HullView& hull, int face, const Vec3& p) {
  const HullPolyhedron polyhedron{&hull};
  const Vec3 n = polyhedron.face_normal(face);
  const int count = polyhedron.corner_count(face);
  for (int k = 0; k < count; ++k) {
    const Vec3 from = polyhedron.corner(face, k);
    const Vec3 to = polyhedron.corner(face, k + 1 == count ? 0 : k + 1);
    if (dot(cross(to - from, n), p - from) > 0) return false;
  }
  return true;
}

/// The closest point is on a face that is below the point, or on an edge.
JFPX_HD inline HullPoint closest_to(const HullView& hull, const Vec3& p) {
  const HullPolyhedron polyhedron{&hull};
  HullPoint result;
  int deepest = 0;
  for (int i = 0; i < polyhedron.face_count(); ++i) {
    const Real height = dot(polyhedron.face_normal(i), p) - polyhedron.face_offset(i);
    if (i == 0 || height > result.distance) result.distance = height, deepest = i;
    if (height > 0 && is_above_face(hull, i, p)) return {polyhedron.face_normal(i), height};
  }
  result.normal = polyhedron.face_normal(deepest);
  if (!(result.distance > 0)) return result;
  Vec3 offset;
  Real least = kMaxReal;
  for (int i = 0; i < polyhedron.edge_count(); ++i) {
    const PolyhedronEdge edge = polyhedron.edge(i);
    const Vec3 a = polyhedron.vertex(edge.a), along = polyhedron.vertex(edge.b) - a;
    const Real t = dot(p - a, along) / length_squared(along);
    const Real on_edge = t > 1 ? Real(1) : t > 0 ? t : Real(0);
    const Vec3 from_edge = add_scaled(p - a, along, -on_edge);
    const Real distance2 = length_squared(from_edge);
    if (distance2 < least) least = distance2, offset = from_edge;
  }
  const Real distance = square_root(least);
  if (!(distance > kEpsilon * hull.outer_radius)) return result;
  return {offset * (Real(1) / distance), distance};
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
