/// Hull-triangle collision: separating axes, and the contact points from two faces or two edges.
/// The axis of a contact is chosen in triangle_axis.hpp.
#pragma once

#include "src/collide/polyhedron_pair.hpp"
#include "src/collide/triangle_axis.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// A triangle in the axes of a hull.
struct HullTriangle : LocalTriangle {
  HullPolyhedron hull;

  /// The axes: kFaceAxis + i is the normal of face i of the hull, and kEdgeAxis + 3 i + k is the
  /// cross product of its edge i and edge k of the triangle.
  static constexpr int kEdgeAxis = kFaceAxis + static_cast<int>(Hull::kMaxFaces);

  JFPX_HD EdgePoints edge_points(const LeastOverlap& edges) const {
    const int of_hull = (edges.axis - kEdgeAxis) / 3, k = (edges.axis - kEdgeAxis) % 3;
    const PolyhedronEdge side = hull.edge(of_hull);
    const Vec3 a = hull.vertex(side.a);
    return closest_of_edges(a, hull.vertex(side.b) - a, corner[k], edge(k));
  }
  JFPX_HD Real lowest(const Vec3& axis) const { return -hull.support(-axis); }
};

/// @param shift [m], world axes, motion of the hull since the start of the step
JFPX_HD inline HullTriangle make_hull_triangle(const HullView& hull, const Mat3& axes,
                                               const TriangleInstance& triangle,
                                               const Vec3& shift) {
  HullTriangle result;
  result.hull = {&hull};
  result.place(axes, triangle, shift, hull.centre, hull.outer_radius);
  return result;
}

/// Calls visit(overlap), until it returns false, for the faces of the hull, and for the edges of
/// the triangle with those edges of the hull that support it in the direction of their common
/// normal.
/// @returns false if a call did
template <class Visit>
JFPX_HD bool for_each_axis(const HullTriangle& pair, const Visit& visit) {
  const HullPolyhedron& hull = pair.hull;
  const Real error = pair.error();
  for (int i = 0; i < hull.face_count(); ++i) {
    const Vec3 n = -hull.face_normal(i);
    const Real distance = -hull.face_offset(i) - pair.support(n);
    if (!visit(LeastOverlap{kFaceAxis + i, distance, error, n})) return false;
  }
  for (int i = 0; i < hull.edge_count(); ++i) {
    const PolyhedronEdge edge = hull.edge(i);
    const Vec3 a = hull.vertex(edge.a), along = hull.vertex(edge.b) - a;
    const Vec3 u = hull.face_normal(edge.face), v = hull.face_normal(edge.other_face);
    const Vec3 uv = cross(u, v);
    for (int k = 0; k < 3; ++k) {
      const Vec3 side = pair.edge(k);
      Vec3 n = cross(along, side);
      const Real across2 = length_squared(n), sizes = length_squared(along) * length_squared(side);
      if (!(across2 > 4 * kEpsilon * sizes)) continue;
      if (dot(n, u + v) > 0) n = -n;  // opposite to the normals of the hull
      if (dot(cross(u, n), uv) > 0 || dot(cross(n, v), uv) > 0) continue;  // not on the arc
      n = n * (Real(1) / square_root(across2));
      if (!visit(LeastOverlap{HullTriangle::kEdgeAxis + 3 * i + k, dot(n, a) - pair.support(n),
                              error * square_root(sizes / across2), n})) {
        return false;
      }
    }
  }
  return true;
}

/// Calls add(point, distance, feature) for the points of the contact, in the axes of the hull; the
/// point is in the middle of the overlap. Of points on an edge whose neighbor is in the same plane,
/// only corners of the hull are kept: see points_on_triangle().
template <class Add>
JFPX_HD void visit_contact_points(const HullTriangle& pair, const LeastOverlap& least, Real margin,
                                  const Add& add) {
  const HullPolyhedron& hull = pair.hull;
  if (least.axis >= HullTriangle::kEdgeAxis) {
    if (!(least.distance <= margin)) return;
    const int edges = least.axis - HullTriangle::kEdgeAxis, of_hull = edges / 3, k = edges % 3;
    add(pair.edge_points(least).middle(), least.distance,
        0x80000000u + static_cast<std::uint32_t>(4 * of_hull + k));
    return;
  }
  // The corners in counterclockwise order, seen from the side of the hull.
  const bool is_flipped =
      dot(cross(pair.edge(0), pair.corner[2] - pair.corner[0]), pair.normal) < 0;
  const auto triangle = make_face(
      3, [&](int k) { return pair.corner[is_flipped ? 2 - k : k]; }, pair.normal);
  const auto is_kept_side = [&](int k) {
    const int edge = is_flipped ? (k == 2 ? 2 : 1 - k) : k;
    return (pair.flat_edges >> edge & 1) == 0;
  };
  const bool is_of_hull = least.axis != kNormalAxis;
  const int face = is_of_hull ? least.axis - kFaceAxis : incident_face(hull, pair.normal);
  const auto of_hull = make_face(
      hull.corner_count(face), [&](int k) { return hull.corner(face, k); }, hull.face_normal(face));
  const std::uint32_t faces =
      (static_cast<std::uint32_t>(face) * 2 + (is_of_hull ? 1 : 0)) * PointFeature::kCount;
  const auto keep = [&](const Vec3& n) {
    return [&add, n, margin, faces](const Vec3& p, Real distance, std::uint32_t feature) {
      if (!(distance <= margin)) return;
      add(add_scaled(p, n, distance * Real(-0.5)), distance, faces + feature);
    };
  };
  const auto all = [](int) { return true; };
  if (is_of_hull) {
    visit_face_points(of_hull, triangle, all, 0, keep(hull.face_normal(face)));
  } else {
    visit_face_points(triangle, of_hull, is_kept_side, pair.error(), keep(pair.normal));
  }
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
