/// Box-triangle collision: the separating-axis test over 13 axes (Akenine-Moeller 2001), and the
/// contact points by clipping face against face (Sutherland and Hodgman 1974) or from the closest
/// points of two edges. The normal of a contact is the best axis that is a proximal normal of the
/// mesh: see mesh_triangle.hpp.
#pragma once

#include "src/collide/box_pair.hpp"
#include "src/collide/triangle_axis.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// A triangle in the axes of a box, whose centre is the origin.
struct BoxTriangle : LocalTriangle {
  Vec3 half;

  /// The axes: kFaceAxis + i is axis i of the box, and kEdgeAxis + 3 i + k is the cross product of
  /// that axis and edge k of the triangle.
  static constexpr int kEdgeAxis = kFaceAxis + 3;

  JFPX_HD EdgePoints edge_points(const LeastOverlap& edges) const;
  JFPX_HD Real lowest(const Vec3& axis) const { return -projected_half_length(half, axis); }
};

/// The closest points of an edge of the box and an edge of the triangle, which are not parallel
/// (Goldman 1990).
JFPX_HD inline EdgePoints BoxTriangle::edge_points(const LeastOverlap& edges) const {
  const auto clamp = [](Real x, Real lower, Real upper) {
    return x > upper ? upper : x < lower ? lower : x;
  };
  const int i = (edges.axis - kEdgeAxis) / 3, k = (edges.axis - kEdgeAxis) % 3;
  const Vec3 dir_a = unit_axis(i), dir_b = edge(k);
  Vec3 on_a = jfpx::detail::support(half, Mat3{}, {}, -edges.normal);
  on_a[i] = 0;
  const Vec3 across = corner[k] - on_a, common = cross(dir_a, dir_b);
  const Real scale = Real(1) / length_squared(common);
  const Real s = clamp(dot(cross(across, dir_b), common) * scale, -half[i], half[i]);
  const Real t = clamp(dot(cross(across, dir_a), common) * scale, 0, 1);
  return {add_scaled(on_a, dir_a, s), add_scaled(corner[k], dir_b, t)};
}

/// @param shift [m], world axes, motion of the box since the start of the step
JFPX_HD inline BoxTriangle make_box_triangle(const Box& box, const Mat3& axes,
                                             const TriangleInstance& triangle, const Vec3& shift) {
  BoxTriangle result;
  result.half = box.half_extents;
  result.place(axes, triangle, shift, {}, length(box.half_extents));
  return result;
}

/// Distance of the box from the triangle along an axis.
/// @param axis unit
JFPX_HD inline LeastOverlap overlap_along(const BoxTriangle& pair, int index, const Vec3& axis,
                                          Real error) {
  const Real half = projected_half_length(pair.half, axis);
  const Real above = -pair.support(-axis) - half, below = -pair.support(axis) - half;
  if (above > below) return {index, above, error, -axis};
  return {index, below, error, axis};
}

/// Calls visit(overlap), until it returns false, for all axes except the normal of the triangle.
/// Edges that are nearly parallel have no axis: see least_overlap().
/// @returns false if a call did
template <class Visit>
JFPX_HD bool for_each_axis(const BoxTriangle& pair, const Visit& visit) {
  const Real error = pair.error();
  for (int i = 0; i < 3; ++i) {
    if (!visit(overlap_along(pair, kFaceAxis + i, unit_axis(i), error))) return false;
  }
  for (int k = 0; k < 3; ++k) {
    const Vec3 edge = pair.edge(k);
    const Real size2 = length_squared(edge);
    for (int i = 0; i < 3; ++i) {
      const Vec3 axis = cross(unit_axis(i), edge);
      const Real across2 = length_squared(axis);
      if (!(across2 > 4 * kEpsilon * size2)) continue;
      const Real scale = Real(1) / square_root(across2);
      if (!visit(overlap_along(pair, BoxTriangle::kEdgeAxis + 3 * i + k, axis * scale,
                               error * (square_root(size2) * scale)))) {
        return false;
      }
    }
  }
  return true;
}

/// The part of a polygon where dot(normal, p) <= limit.
/// @param corners bit i: corner i of the polygon is a corner of the clipped face; updated
/// @param plane   number of the edge along the clipping plane
JFPX_HD inline Polygon clipped(const Polygon& polygon, const Vec3& normal, Real limit, int plane,
                               std::uint32_t* corners) {
  Polygon result;
  std::uint32_t kept = 0;
  for (int i = 0; i < polygon.count; ++i) {
    const Vec3& from = polygon.corner[i];
    const Vec3& to = polygon.corner[i + 1 == polygon.count ? 0 : i + 1];
    const Real d_from = dot(normal, from) - limit, d_to = dot(normal, to) - limit;
    const int edge = polygon.edge[i];
    if (d_from <= 0) {
      kept |= (*corners >> i & 1) << result.count;
      result.add(from, d_from < 0 || d_to <= 0 ? edge : plane);
    }
    if ((d_from < 0 && d_to > 0) || (d_from > 0 && d_to < 0)) {
      result.add(add_scaled(from, to - from, d_from / (d_from - d_to)), d_from < 0 ? plane : edge);
    }
  }
  *corners = kept;
  return result;
}

/// Clips the incident face of the box against the sides of the triangle. Of points on an edge whose
/// neighbor is in the same plane, only corners of the box are kept: the others are inside the
/// polygon that the box and the plane have in common.
/// @param manifold receives the points, in the axes of the box
JFPX_HD inline void points_on_triangle(const BoxTriangle& pair, Real margin, Manifold* manifold) {
  constexpr int kPlanes = 4;  // edges from here on lie in the sides of the triangle
  int incident = 0;
  Polygon polygon = facing_quad(pair.half, Mat3{}, {}, pair.normal, &incident);
  std::uint32_t corners = 0xf;
  for (int k = 0; k < 3; ++k) {
    Vec3 outward = cross(pair.edge(k), pair.normal);
    const Vec3& third = pair.corner[next_corner(next_corner(k))];
    if (dot(outward, third - pair.corner[k]) > 0) outward = -outward;
    // A corner exactly above the edge must not be lost by rounding.
    const bool is_flat = (pair.flat_edges >> k & 1) != 0;
    const Real slack = is_flat ? pair.error() * length(outward) : Real(0);
    polygon =
        clipped(polygon, outward, dot(outward, pair.corner[k]) + slack, kPlanes + k, &corners);
  }
  const auto is_flat = [&](int edge) {
    return edge >= kPlanes && (pair.flat_edges >> (edge - kPlanes) & 1) != 0;
  };
  for (int i = 0; i < polygon.count; ++i) {
    const int before = polygon.edge[i == 0 ? polygon.count - 1 : i - 1], after = polygon.edge[i];
    if ((corners >> i & 1) == 0 && (is_flat(before) || is_flat(after))) continue;
    const Vec3& p = polygon.corner[i];
    const Real distance = dot(pair.normal, p - pair.corner[0]);
    if (!(distance <= margin)) continue;
    manifold->points[manifold->count++] = {
        add_scaled(p, pair.normal, distance * Real(-0.5)), distance,
        static_cast<std::uint32_t>(64 * incident + 8 * before + after)};
  }
}

/// Clips the triangle against the sides of a face of the box.
JFPX_HD inline void points_on_box(const BoxTriangle& pair, int face, Real side, Real margin,
                                  Manifold* manifold) {
  Polygon polygon;
  for (int k = 0; k < 3; ++k) polygon.add(pair.corner[k], k);
  for (int k = 1; k < 3; ++k) {
    const int axis = (face + k) % 3;
    polygon = clipped(polygon, axis, 1, pair.half[axis], 2 * k + 2);
    polygon = clipped(polygon, axis, -1, pair.half[axis], 2 * k + 3);
  }
  const Vec3 outward = unit_axis(face) * side;
  for (int i = 0; i < polygon.count; ++i) {
    const Real distance = side * polygon.corner[i][face] - pair.half[face];
    if (!(distance <= margin)) continue;
    const int before = polygon.edge[i == 0 ? polygon.count - 1 : i - 1];
    manifold->points[manifold->count++] = {
        add_scaled(polygon.corner[i], outward, distance * Real(-0.5)), distance,
        static_cast<std::uint32_t>(64 * (2 * face + (side > 0 ? 0 : 1)) + 8 * before +
                                   polygon.edge[i])};
  }
}

/// The contact manifold of a box and a triangle, in the axes of the box. The normal points from the
/// triangle to the box.
/// @param least  of find_contact_axis()
/// @param margin largest distance of a point of the manifold
JFPX_HD inline Manifold triangle_manifold(const BoxTriangle& pair, const LeastOverlap& least,
                                          Real margin) {
  constexpr std::uint32_t kFeaturesOfFace = 6 * 64;
  constexpr int kEdgeAxis = BoxTriangle::kEdgeAxis;
  Manifold manifold;
  manifold.distance = least.distance;
  manifold.normal = least.normal;
  std::uint32_t first_feature = 0;
  if (least.axis == 0) {
    points_on_triangle(pair, margin, &manifold);
  } else if (least.axis < kEdgeAxis) {
    first_feature = kFeaturesOfFace;
    const int face = least.axis - kFaceAxis;
    points_on_box(pair, face, least.normal[face] > 0 ? Real(-1) : Real(1), margin, &manifold);
  } else if (least.distance <= margin) {
    first_feature = 2 * kFeaturesOfFace;
    const int edges = least.axis - kEdgeAxis;
    manifold.points[manifold.count++] = {pair.edge_points(least).middle(), least.distance,
                                         static_cast<std::uint32_t>(edges)};
  }
  for (int i = 0; i < manifold.count; ++i) manifold.points[i].feature += first_feature;
  return manifold;
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
