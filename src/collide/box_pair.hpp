/// Box-box collision: the separating-axis test over 15 axes (Gottschalk, Lin and Manocha 1996), and
/// the contact points for the axis of least penetration, by clipping face against face (Sutherland
/// and Hodgman 1974) or from the closest points of two edges.
#pragma once

#include <jfpx/collide.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Two boxes in the axes of box a. The columns of `rotation` are the axes of b; `offset` is its
/// centre.
struct BoxPair {
  Vec3 half_a, half_b;
  Mat3 rotation;
  Vec3 offset;  ///< [m]
  Real size;    ///< [m], sum of the half diagonals: the scale of the rounding errors
};

/// The tested axis with the least overlap. Face normals of a have the numbers 0 to 2, those of b 3
/// to 5, and the cross product of edge i of a and edge j of b has the number 6 + 3 i + j.
struct LeastOverlap {
  int axis = -1;      ///< number of the axis; -1: none tested
  Real distance = 0;  ///< [m], <= 0
  Real error = 0;     ///< [m], bound of the rounding error of `distance`
  Vec3 normal;        ///< unit, in the axes of a, from b to a
};

/// The closest points of two edges.
struct EdgePoints {
  Vec3 on_a, on_b;  ///< [m]

  JFPX_HD Vec3 middle() const { return (on_a + on_b) * Real(0.5); }
  /// Whether the points are as far apart as two solids along an axis, in its direction. Otherwise,
  /// the edges do not cross, and the solids overlap less along another axis.
  JFPX_HD bool are_on(const LeastOverlap& axis) const {
    const Real tolerance = 8 * axis.error + absolute(axis.distance) * Real(0.1);
    const Vec3 apart = add_scaled(on_a - on_b, axis.normal, -axis.distance);
    return length_squared(apart) <= tolerance * tolerance;
  }
};

JFPX_HD constexpr Vec3 unit_axis(int i) {
  return {i == 0 ? Real(1) : Real(0), i == 1 ? Real(1) : Real(0), i == 2 ? Real(1) : Real(0)};
}
/// Half the length of a box's projection onto an axis in the box's coordinates.
JFPX_HD inline Real projected_half_length(const Vec3& half, const Vec3& axis) {
  return dot(half, {absolute(axis.x), absolute(axis.y), absolute(axis.z)});
}

/// False if the unit vector `axis` separates the boxes by more than `margin`. Otherwise replaces
/// *best by this axis, number `index`, if its overlap is smaller.
JFPX_HD inline bool try_axis(const BoxPair& pair, int index, const Vec3& axis, Real error,
                             Real margin, LeastOverlap* best) {
  const Real along = dot(axis, pair.offset);
  const Real sum = projected_half_length(pair.half_a, axis) +
                   projected_half_length(pair.half_b, transform_transpose(pair.rotation, axis));
  const Real distance = absolute(along) - sum;
  if (!(distance <= margin)) return false;
  if (best->axis < 0 || distance > best->distance) {
    *best = {index, distance, error, along > 0 ? -axis : axis};
  }
  return true;
}

/// Returns `later` if its overlap is smaller, or its separation larger, by more than its rounding
/// error and two per cent; otherwise `first`. A resting box thus keeps its face and contact points
/// from step to step.
JFPX_HD inline const LeastOverlap& preferred(const LeastOverlap& first, const LeastOverlap& later) {
  const Real tolerance = later.error + absolute(first.distance) * Real(0.02);
  return later.axis >= 0 && later.distance > first.distance + tolerance ? later : first;
}

/// As preferred() for a face and a pair of edges. The common normal of the edges does not replace
/// that of a face within a tenth of a degree of it, because a face has several points.
JFPX_HD inline const LeastOverlap& preferred_to_edges(const LeastOverlap& face,
                                                      const LeastOverlap& edges) {
  constexpr Real kLeastAngle = Real(0.0017);
  const bool is_same = length_squared(face.normal - edges.normal) < kLeastAngle * kLeastAngle;
  return is_same ? face : preferred(face, edges);
}

/// False if an axis separates the boxes by more than `margin`. Otherwise writes the axis of least
/// overlap, or of the largest separation, to *best.
/// @param is_steady whether a face is preferred to edges with nearly the same normal
JFPX_HD inline bool least_overlap(const BoxPair& pair, Real margin, bool is_steady,
                                  LeastOverlap* best) {
  const Real error = 8 * kEpsilon * pair.size;
  LeastOverlap face_a, face_b, edges;
  for (int i = 0; i < 3; ++i) {
    if (!try_axis(pair, i, unit_axis(i), error, margin, &face_a)) return false;
    if (!try_axis(pair, 3 + i, pair.rotation.column(i), error, margin, &face_b)) return false;
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const Vec3 axis = cross(unit_axis(i), pair.rotation.column(j));
      // Nearly parallel edges have no well-defined common normal: its error, epsilon / sine, would
      // exceed the gap missed by the face axes, which is proportional to the sine (erratum E15).
      const Real sine = length(axis);
      if (!(sine * sine > 4 * kEpsilon)) continue;
      const Vec3 unit = axis * (Real(1) / sine);
      if (!try_axis(pair, 6 + 3 * i + j, unit, error / sine, margin, &edges)) return false;
    }
  }
  const LeastOverlap& face = preferred(face_a, face_b);
  *best = is_steady ? preferred_to_edges(face, edges) : preferred(face, edges);
  return true;
}

/// A convex polygon in the axes of a reference box. Edges 0 to 3 are those of the incident face;
/// edges 4 to 7 lie in the clipping planes.
struct Polygon {
  Vec3 corner[8];
  int edge[8] = {};  ///< from each corner to the next one
  int count = 0;
  JFPX_HD constexpr void add(const Vec3& p, int edge_after) {
    edge[count] = edge_after;
    corner[count++] = p;
  }
};

/// The part of a polygon where side * p[axis] <= limit. A quadrilateral that is clipped four times
/// has at most eight corners.
/// @param plane number of the edge along the clipping plane
JFPX_HD inline Polygon clipped(const Polygon& polygon, int axis, Real side, Real limit, int plane) {
  Polygon result;
  for (int i = 0; i < polygon.count; ++i) {
    const Vec3& from = polygon.corner[i];
    const Vec3& to = polygon.corner[i + 1 == polygon.count ? 0 : i + 1];
    const Real d_from = side * from[axis] - limit, d_to = side * to[axis] - limit;
    const int edge = polygon.edge[i];
    if (d_from <= 0) result.add(from, d_from < 0 || d_to <= 0 ? edge : plane);
    if ((d_from < 0 && d_to > 0) || (d_from > 0 && d_to < 0)) {
      Vec3 cut = add_scaled(from, to - from, d_from / (d_from - d_to));
      cut[axis] = side * limit;
      result.add(cut, d_from < 0 ? plane : edge);
    }
  }
  return result;
}

/// The incident face: the face of a box whose outward normal is most antiparallel to `normal`, in
/// the axes of the pose (`rotation`, `offset`).
/// @param face receives the number of the face, 0 to 5
JFPX_HD inline Polygon facing_quad(const Vec3& half, const Mat3& rotation, const Vec3& offset,
                                   const Vec3& normal, int* face) {
  const Vec3 local = transform_transpose(rotation, normal);
  int f = 0;
  for (int i = 1; i < 3; ++i) {
    if (absolute(local[i]) > absolute(local[f])) f = i;
  }
  const int u = (f + 1) % 3, v = (f + 2) % 3;
  const Vec3 centre = add_scaled(offset, rotation.column(f), local[f] > 0 ? -half[f] : half[f]);
  const Vec3 to_u = rotation.column(u) * half[u], to_v = rotation.column(v) * half[v];
  *face = 2 * f + (local[f] > 0 ? 0 : 1);
  Polygon quad;
  quad.add(centre + to_u + to_v, 0);
  quad.add(centre - to_u + to_v, 1);
  quad.add(centre - to_u - to_v, 2);
  quad.add(centre + to_u - to_v, 3);
  return quad;
}

/// Support mapping: the corner of a posed box that is farthest along `direction`.
JFPX_HD inline Vec3 support(const Vec3& half, const Mat3& rotation, const Vec3& offset,
                            const Vec3& direction) {
  const Vec3 local = transform_transpose(rotation, direction);
  Vec3 corner;
  for (int i = 0; i < 3; ++i) corner[i] = local[i] < 0 ? -half[i] : half[i];
  return rotation * corner + offset;
}

/// Clips the incident face of the other box (`rotation`, `offset`) against the sides of the
/// reference face, whose outward normal is `side` times axis `face` of the reference box, and keeps
/// the points at most `margin` above the reference face.
/// @param manifold receives the points, in the axes of the reference box
JFPX_HD inline void face_points(const Vec3& half, int face, Real side, const Vec3& other_half,
                                const Mat3& rotation, const Vec3& offset, Real margin,
                                Manifold* manifold) {
  const Vec3 outward = unit_axis(face) * side;
  int incident = 0;
  Polygon polygon;
  const auto keep = [&](const Vec3& p, Real distance, int feature) {
    const int faces = 6 * (2 * face + (side > 0 ? 0 : 1)) + incident;
    manifold->points[manifold->count++] = {add_scaled(p, outward, distance * Real(-0.5)), distance,
                                           static_cast<std::uint32_t>(64 * faces + feature)};
  };
  // For faces that touch along an edge, rounding may remove all points. Then the sides are
  // enlarged.
  const Real error = 16 * kEpsilon * (length(half) + length(other_half));
  for (int pass = 0; pass < 2; ++pass) {
    const Real slack = pass == 0 ? Real(0) : error;
    polygon = facing_quad(other_half, rotation, offset, outward, &incident);
    for (int k = 1; k < 3; ++k) {
      const int axis = (face + k) % 3;
      polygon = clipped(polygon, axis, 1, half[axis] + slack, 2 * k + 2);
      polygon = clipped(polygon, axis, -1, half[axis] + slack, 2 * k + 3);
    }
    for (int i = 0; i < polygon.count; ++i) {
      const Real distance = side * polygon.corner[i][face] - half[face];
      const int before = polygon.edge[i == 0 ? polygon.count - 1 : i - 1];
      if (distance <= margin) keep(polygon.corner[i], distance, 8 * before + polygon.edge[i]);
    }
    if (manifold->count > 0 || !(manifold->distance <= 0)) return;
  }
  // By rounding, all points are above the margin, or there are none.
  Vec3 lowest =
      polygon.count > 0 ? polygon.corner[0] : support(other_half, rotation, offset, -outward);
  for (int i = 1; i < polygon.count; ++i) {
    if (side * polygon.corner[i][face] < side * lowest[face]) lowest = polygon.corner[i];
  }
  keep(lowest, manifold->distance, 0);
}

/// The midpoint between the closest points of two lines (Goldman 1990), clamped to the edges: edge
/// i of a and edge j of b, in each direction the edge nearest to the other box. If the boxes
/// overlap and only one edge is too short, the midpoint at its end. The edges must not be parallel.
JFPX_HD inline Vec3 edge_point(const BoxPair& pair, int i, int j, const LeastOverlap& least) {
  const Mat3 identity;
  const Vec3 dir_a = unit_axis(i), dir_b = pair.rotation.column(j);
  Vec3 on_a = support(pair.half_a, identity, {}, -least.normal);
  on_a[i] = 0;
  Vec3 on_b = support(pair.half_b, pair.rotation, pair.offset, least.normal);
  on_b -= dir_b * dot(dir_b, on_b - pair.offset);
  const Vec3 across = on_b - on_a, common = cross(dir_a, dir_b);
  // For edges at a small angle, determinants lose half as many digits as the cosine.
  const Real scale = Real(1) / length_squared(common);
  const auto clamp = [](Real x, Real limit) { return x > limit ? limit : x < -limit ? -limit : x; };
  const Real s = dot(cross(across, dir_b), common) * scale;
  const Real t = dot(cross(across, dir_a), common) * scale;
  const Real s_on_edge = clamp(s, pair.half_a[i]), t_on_edge = clamp(t, pair.half_b[j]);
  const Vec3 p = add_scaled(on_a, dir_a, s_on_edge), q = add_scaled(on_b, dir_b, t_on_edge);
  // Edges of least overlap cross each other. If rounding has selected other edges, the end of the
  // edge that is too short is in the overlap.
  const bool overlaps = least.distance <= 0;
  const bool a_ends = overlaps && s != s_on_edge, b_ends = overlaps && t != t_on_edge;
  if (a_ends && !b_ends) return add_scaled(p, least.normal, least.distance * Real(-0.5));
  if (b_ends && !a_ends) return add_scaled(q, least.normal, least.distance * Real(0.5));
  return (p + q) * Real(0.5);
}

/// Two boxes in the axes of the first.
JFPX_HD inline BoxPair make_box_pair(const Box& a, const Transform& pose_a, const Box& b,
                                     const Transform& pose_b) {
  return {a.half_extents, b.half_extents, transposed(pose_a.basis) * pose_b.basis,
          transform_transpose(pose_a.basis, pose_b.origin - pose_a.origin),
          length(a.half_extents) + length(b.half_extents)};
}

/// The contact manifold of two boxes for an axis of least overlap. The normal points from b to a.
/// Feature numbers of a reference face of b, and of edges, are above those of a.
/// @param margin largest distance of a point of the manifold
JFPX_HD inline Manifold box_manifold(const BoxPair& pair, const LeastOverlap& least,
                                     const Transform& pose_a, const Transform& pose_b,
                                     Real margin) {
  constexpr std::uint32_t kFeaturesOfBox = 36 * 64;
  Manifold manifold;
  manifold.distance = least.distance;
  manifold.normal = pose_a.basis * least.normal;

  const Transform* frame = &pose_a;
  std::uint32_t first_feature = 0;
  if (least.axis < 3) {
    const Real side = least.normal[least.axis] > 0 ? Real(-1) : Real(1);
    face_points(pair.half_a, least.axis, side, pair.half_b, pair.rotation, pair.offset, margin,
                &manifold);
  } else if (least.axis < 6) {
    frame = &pose_b;
    first_feature = kFeaturesOfBox;
    const int face = least.axis - 3;
    const Real side = dot(least.normal, pair.rotation.column(face)) > 0 ? Real(1) : Real(-1);
    face_points(pair.half_b, face, side, pair.half_a, transposed(pair.rotation),
                -transform_transpose(pair.rotation, pair.offset), margin, &manifold);
  } else {
    const int edges = least.axis - 6;
    manifold.points[manifold.count++] = {edge_point(pair, edges / 3, edges % 3, least),
                                         least.distance,
                                         2 * kFeaturesOfBox + static_cast<std::uint32_t>(edges)};
  }
  for (int i = 0; i < manifold.count; ++i) {
    manifold.points[i].point = transform_point(*frame, manifold.points[i].point);
    manifold.points[i].feature += first_feature;
  }
  return manifold;
}

/// The contact manifold of two boxes, also for boxes in exact contact. The normal points from b to
/// a.
JFPX_HD inline Manifold collide_boxes(const Box& a, const Transform& pose_a, const Box& b,
                                      const Transform& pose_b) {
  const BoxPair pair = make_box_pair(a, pose_a, b, pose_b);
  LeastOverlap least;
  if (!least_overlap(pair, 0, false, &least)) return {};
  return box_manifold(pair, least, pose_a, pose_b, 0);
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
