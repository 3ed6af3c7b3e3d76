/// Hull-triangle collision: separating axes, and the contact points from two faces or two edges.
/// The normal of a contact is the best axis that is a proximal normal of the mesh: see
/// mesh_triangle.hpp.
#pragma once

#include "src/collide/box_triangle.hpp"
#include "src/collide/polyhedron_pair.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// A triangle in the axes of a hull.
struct HullTriangle {
  HullPolyhedron hull;
  Vec3 corner[3];  ///< [m]
  Vec3 normal;     ///< unit, to the side of the hull
  std::uint32_t flat_edges = 0;
  Real size = 0;  ///< [m], the scale of the rounding errors

  JFPX_HD Vec3 edge(int k) const { return corner[next_corner(k)] - corner[k]; }
  JFPX_HD Real error() const { return 8 * kEpsilon * size; }
  /// [m], largest coordinate of the corners along an axis.
  JFPX_HD Real support(const Vec3& axis) const {
    const Real p = dot(axis, corner[0]), q = dot(axis, corner[1]), r = dot(axis, corner[2]);
    const Real pq = p < q ? q : p;
    return r > pq ? r : pq;
  }
};

/// @param shift [m], world axes, motion of the hull since the start of the step
JFPX_HD inline HullTriangle make_hull_triangle(const HullView& hull, const Mat3& axes,
                                               const TriangleInstance& triangle,
                                               const Vec3& shift) {
  HullTriangle result;
  result.hull = {&hull};
  result.normal = transform_transpose(axes, triangle.normal);
  result.flat_edges = triangle.triangle->flat_edges;
  Real farthest = 0;
  for (int k = 0; k < 3; ++k) {
    result.corner[k] = transform_transpose(axes, triangle.corner[k] - shift) + hull.centre;
    const Real distance = length(result.corner[k]);
    farthest = distance > farthest ? distance : farthest;
  }
  result.size = hull.outer_radius + farthest;
  return result;
}

/// An axis of a hull and a triangle.
struct HullTriangleAxis {
  enum Kind : std::uint8_t { none, triangle, face, edges };
  Kind kind = none;
  int first = 0, second = 0;  ///< face of the hull, or edges of the hull and the triangle
  LeastOverlap overlap;       ///< the normal is from the triangle to the hull
};

JFPX_HD inline LeastOverlap overlap_along_normal(const HullTriangle& pair) {
  return {0, -pair.hull.support(-pair.normal) - dot(pair.normal, pair.corner[0]), pair.error(),
          pair.normal};
}

/// Calls visit(axis), until it returns false, for the faces of the hull, and for the edges of the
/// triangle with those edges of the hull that support it in the direction of their common normal.
/// @returns false if a call did
template <class Visit>
JFPX_HD bool for_each_axis(const HullTriangle& pair, const Visit& visit) {
  const HullPolyhedron& hull = pair.hull;
  HullTriangleAxis axis;
  axis.kind = HullTriangleAxis::face;
  for (int i = 0; i < hull.face_count(); ++i) {
    const Vec3 n = -hull.face_normal(i);
    axis.first = i;
    axis.overlap = {0, -hull.face_offset(i) - pair.support(n), pair.error(), n};
    if (!visit(axis)) return false;
  }
  axis.kind = HullTriangleAxis::edges;
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
      axis.first = i;
      axis.second = k;
      axis.overlap = {0, dot(n, a) - pair.support(n), pair.error() * square_root(sizes / across2),
                      n};
      if (!visit(axis)) return false;
    }
  }
  return true;
}

/// False if an axis separates the shapes by more than `limit`. Otherwise writes the axis of the
/// largest separation, or of least overlap.
JFPX_HD inline bool widest_separation(const HullTriangle& pair, Real limit,
                                      HullTriangleAxis* widest) {
  *widest = {HullTriangleAxis::triangle, 0, 0, overlap_along_normal(pair)};
  if (widest->overlap.distance > limit) return false;
  return for_each_axis(pair, [&](const HullTriangleAxis& axis) {
    if (axis.overlap.distance > widest->overlap.distance) *widest = axis;
    return axis.overlap.distance <= limit;
  });
}

/// The axis of the contact, by the rules of contact_axis() and is_contact() for boxes.
/// @returns false if the triangle has no contact
JFPX_HD inline bool find_contact_axis(const HullTriangle& pair, const TriangleInstance& triangle,
                                      const Mat3& axes, const HullTriangleAxis& widest,
                                      HullTriangleAxis* result) {
  const HullTriangleAxis normal{HullTriangleAxis::triangle, 0, 0, overlap_along_normal(pair)};
  HullTriangleAxis faces, edges;
  for_each_axis(pair, [&](const HullTriangleAxis& axis) {
    HullTriangleAxis* best = axis.kind == HullTriangleAxis::face ? &faces : &edges;
    const LeastOverlap& overlap = axis.overlap;
    if (best->kind != HullTriangleAxis::none && !(overlap.distance > best->overlap.distance)) {
      return true;
    }
    if (!(overlap.distance > normal.overlap.distance)) return true;
    if (are_parallel(overlap.normal, pair.normal)) return true;
    if (best == &edges && faces.kind != HullTriangleAxis::none &&
        are_parallel(overlap.normal, faces.overlap.normal)) {
      return true;
    }
    const int feature = supporting_feature(pair.corner, overlap);
    if (feature == kFace) return true;
    if (triangle.is_proximal(feature, axes * overlap.normal)) *best = axis;
    return true;
  });
  const auto better = [](const HullTriangleAxis& first,
                         const HullTriangleAxis& later) -> const HullTriangleAxis& {
    if (later.kind == HullTriangleAxis::none) return first;
    return &preferred(first.overlap, later.overlap) == &first.overlap ? first : later;
  };
  *result = better(better(normal, faces), edges);
  const LeastOverlap& chosen = result->overlap;
  if (&preferred(chosen, widest.overlap) == &chosen) return true;
  if (are_parallel(chosen.normal, widest.overlap.normal)) return true;
  if (widest.overlap.distance > 0 && chosen.distance < 0) return false;
  if (result->kind != HullTriangleAxis::triangle) return true;
  bool is_nearer_to_neighbor = false;
  triangle.visit_convex_neighbors([&](const Vec3& n) {
    const Vec3 axis = transform_transpose(axes, n);
    const LeastOverlap neighbor{0, -pair.hull.support(-axis) - pair.support(axis), chosen.error,
                                axis};
    is_nearer_to_neighbor |= &preferred(chosen, neighbor) == &neighbor;
  });
  return !is_nearer_to_neighbor;
}

/// Calls add(point, distance, feature) for the points of the contact, in the axes of the hull; the
/// point is in the middle of the overlap. Of points on an edge whose neighbor is in the same plane,
/// only corners of the hull are kept: see points_on_triangle().
template <class Add>
JFPX_HD void visit_contact_points(const HullTriangle& pair, const HullTriangleAxis& axis,
                                  Real margin, const Add& add) {
  const HullPolyhedron& hull = pair.hull;
  const auto first = static_cast<std::uint32_t>(axis.first);
  if (axis.kind == HullTriangleAxis::edges) {
    if (!(axis.overlap.distance <= margin)) return;
    const PolyhedronEdge edge = hull.edge(axis.first);
    const Vec3 a = hull.vertex(edge.a);
    add(middle_of_edges(a, hull.vertex(edge.b) - a, pair.corner[axis.second],
                        pair.edge(axis.second)),
        axis.overlap.distance, 0x80000000u + first * 4 + static_cast<std::uint32_t>(axis.second));
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
  const bool is_of_hull = axis.kind == HullTriangleAxis::face;
  const int face = is_of_hull ? axis.first : incident_face(hull, pair.normal);
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
