/// Box against box: the separating-axis test over 15 axes (Gottschalk, Lin and Manocha 1996) and
/// the contact points of the axis of least depth, by clipping face against face (Sutherland and
/// Hodgman 1974) or between two edges.
#pragma once

#include <jfpx/collide.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Both boxes in the axes of box a: b's axes are the columns of `turn`, its centre is `offset`.
struct BoxPair {
  Vec3 half_a, half_b;
  Mat3 turn;
  Vec3 offset;
  Real size;  ///< [m], sum of the half diagonals: the scale of rounding errors
};

/// An axis on which the boxes overlap least so far. Faces of a are 0..2, faces of b 3..5, and edge
/// i of a across edge j of b is 6 + 3 i + j.
struct LeastOverlap {
  int axis = -1;
  Real distance = 0;  ///< <= 0
  Real error = 0;     ///< what rounding may have done to the distance
  Vec3 normal;        ///< axes of a, unit, from b to a
};

JFPX_HD constexpr Vec3 unit_axis(int i) {
  return {i == 0 ? Real(1) : Real(0), i == 1 ? Real(1) : Real(0), i == 2 ? Real(1) : Real(0)};
}
/// Half the length of a box's shadow on an axis given in the box's axes.
JFPX_HD inline Real shadow(const Vec3& half, const Vec3& axis) {
  return dot(half, {absolute(axis.x), absolute(axis.y), absolute(axis.z)});
}

/// False if the unit vector `axis` separates the boxes. Otherwise takes it if it overlaps less than
/// the best so far.
JFPX_HD inline bool try_axis(const BoxPair& pair, int name, const Vec3& axis, Real error,
                             LeastOverlap* best) {
  const Real along = dot(axis, pair.offset);
  const Real reach =
      shadow(pair.half_a, axis) + shadow(pair.half_b, transform_transpose(pair.turn, axis));
  const Real distance = absolute(along) - reach;
  if (!(distance <= 0)) return false;
  if (best->axis < 0 || distance > best->distance) {
    *best = {name, distance, error, along > 0 ? -axis : axis};
  }
  return true;
}

/// `later` where it overlaps less by more than its rounding errors and two per cent, else `first`:
/// a box that lies flat keeps one and the same face, and its points, from step to step.
JFPX_HD constexpr const LeastOverlap& preferred(const LeastOverlap& first,
                                                const LeastOverlap& later) {
  const Real handicap = later.error - first.distance * Real(0.02);
  return later.axis >= 0 && later.distance > first.distance + handicap ? later : first;
}

/// False if an axis separates the boxes.
JFPX_HD inline bool least_overlap(const BoxPair& pair, LeastOverlap* best) {
  const Real noise = 8 * kEpsilon * pair.size;
  LeastOverlap face_a, face_b, edges;
  for (int i = 0; i < 3; ++i) {
    if (!try_axis(pair, i, unit_axis(i), noise, &face_a)) return false;
    if (!try_axis(pair, 3 + i, pair.turn.column(i), noise, &face_b)) return false;
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const Vec3 axis = cross(unit_axis(i), pair.turn.column(j));
      // Edges this parallel have no common normal to speak of: its error, epsilon / sine, would be
      // larger than the gap that the faces miss, of the order of the sine (erratum E15).
      const Real sine = length(axis);
      if (!(sine * sine > 4 * kEpsilon)) continue;
      const Vec3 unit = axis * (Real(1) / sine);
      if (!try_axis(pair, 6 + 3 * i + j, unit, noise / sine, &edges)) return false;
    }
  }
  *best = preferred(preferred(face_a, face_b), edges);
  return true;
}

/// A convex polygon in the axes of a reference box.
struct Polygon {
  Vec3 corner[8];
  int count = 0;
  JFPX_HD constexpr void add(const Vec3& p) { corner[count++] = p; }
};

/// The part of a polygon where side * p[axis] <= limit. Four cuts of a quadrangle leave at most
/// eight corners.
JFPX_HD inline Polygon clipped(const Polygon& polygon, int axis, Real side, Real limit) {
  Polygon result;
  for (int i = 0; i < polygon.count; ++i) {
    const Vec3& from = polygon.corner[i];
    const Vec3& to = polygon.corner[i + 1 == polygon.count ? 0 : i + 1];
    const Real d_from = side * from[axis] - limit, d_to = side * to[axis] - limit;
    if (d_from <= 0) result.add(from);
    if ((d_from < 0 && d_to > 0) || (d_from > 0 && d_to < 0)) {
      Vec3 cut = add_scaled(from, to - from, d_from / (d_from - d_to));
      cut[axis] = side * limit;
      result.add(cut);
    }
  }
  return result;
}

/// The face of a box that looks most against `normal`, in the axes in which the box is posed.
JFPX_HD inline Polygon facing_quad(const Vec3& half, const Mat3& turn, const Vec3& offset,
                                   const Vec3& normal) {
  const Vec3 local = transform_transpose(turn, normal);
  int f = 0;
  for (int i = 1; i < 3; ++i) {
    if (absolute(local[i]) > absolute(local[f])) f = i;
  }
  const int u = (f + 1) % 3, v = (f + 2) % 3;
  const Vec3 centre = add_scaled(offset, turn.column(f), local[f] > 0 ? -half[f] : half[f]);
  const Vec3 to_u = turn.column(u) * half[u], to_v = turn.column(v) * half[v];
  Polygon quad;
  quad.add(centre + to_u + to_v);
  quad.add(centre - to_u + to_v);
  quad.add(centre - to_u - to_v);
  quad.add(centre + to_u - to_v);
  return quad;
}

/// The corner of a posed box that is farthest along `direction`.
JFPX_HD inline Vec3 support(const Vec3& half, const Mat3& turn, const Vec3& offset,
                            const Vec3& direction) {
  const Vec3 local = transform_transpose(turn, direction);
  Vec3 corner;
  for (int i = 0; i < 3; ++i) corner[i] = local[i] < 0 ? -half[i] : half[i];
  return turn * corner + offset;
}

/// Cuts the face of the other box (`turn`, `offset`) to the prism over the reference face, whose
/// outward normal is +-axis `face` of the reference box, and keeps what is below the face.
/// @param manifold gets points in the axes of the reference box
JFPX_HD inline void face_points(const Vec3& half, int face, Real side, const Vec3& other_half,
                                const Mat3& turn, const Vec3& offset, Manifold* manifold) {
  const Vec3 outward = unit_axis(face) * side;
  Polygon polygon = facing_quad(other_half, turn, offset, outward);
  for (int k = 1; k < 3; ++k) {
    const int axis = (face + k) % 3;
    polygon = clipped(polygon, axis, 1, half[axis]);
    polygon = clipped(polygon, axis, -1, half[axis]);
  }
  const auto keep = [&](const Vec3& p, Real distance) {
    manifold->points[manifold->count++] = {add_scaled(p, outward, distance * Real(-0.5)), distance};
  };
  for (int i = 0; i < polygon.count; ++i) {
    const Real distance = side * polygon.corner[i][face] - half[face];
    if (distance <= 0) keep(polygon.corner[i], distance);
  }
  // Rounding may leave nothing of faces that touch along an edge.
  if (manifold->count == 0) {
    keep(support(other_half, turn, offset, -outward), manifold->distance);
  }
}

/// The point half-way between edge i of a and edge j of b, those that face each other (Goldman
/// 1990). The edges are not parallel.
JFPX_HD inline Vec3 edge_point(const BoxPair& pair, int i, int j, const Vec3& normal) {
  const Mat3 upright;
  const Vec3 dir_a = unit_axis(i), dir_b = pair.turn.column(j);
  Vec3 on_a = support(pair.half_a, upright, {}, -normal);
  on_a[i] = 0;
  Vec3 on_b = support(pair.half_b, pair.turn, pair.offset, normal);
  on_b -= dir_b * dot(dir_b, on_b - pair.offset);
  const Vec3 across = on_b - on_a, common = cross(dir_a, dir_b);
  // By determinants: with the cosine, edges at a small angle would lose twice the digits.
  const Real scale = Real(1) / length_squared(common);
  const auto within = [](Real x, Real most) { return x > most ? most : x < -most ? -most : x; };
  const Real s = within(dot(cross(across, dir_b), common) * scale, pair.half_a[i]);
  const Real t = within(dot(cross(across, dir_a), common) * scale, pair.half_b[j]);
  return (add_scaled(on_a, dir_a, s) + add_scaled(on_b, dir_b, t)) * Real(0.5);
}

/// Touching counts. The normal points from b to a.
JFPX_HD inline Manifold collide_boxes(const Box& a, const Transform& pose_a, const Box& b,
                                      const Transform& pose_b) {
  const BoxPair pair{a.half_extents, b.half_extents, transposed(pose_a.basis) * pose_b.basis,
                     transform_transpose(pose_a.basis, pose_b.origin - pose_a.origin),
                     length(a.half_extents) + length(b.half_extents)};
  LeastOverlap least;
  Manifold manifold;
  if (!least_overlap(pair, &least)) return manifold;
  manifold.distance = least.distance;
  manifold.normal = pose_a.basis * least.normal;

  const Transform* frame = &pose_a;
  if (least.axis < 3) {
    const Real side = least.normal[least.axis] > 0 ? Real(-1) : Real(1);
    face_points(pair.half_a, least.axis, side, pair.half_b, pair.turn, pair.offset, &manifold);
  } else if (least.axis < 6) {
    frame = &pose_b;
    const int face = least.axis - 3;
    const Real side = dot(least.normal, pair.turn.column(face)) > 0 ? Real(1) : Real(-1);
    face_points(pair.half_b, face, side, pair.half_a, transposed(pair.turn),
                -transform_transpose(pair.turn, pair.offset), &manifold);
  } else {
    const int edges = least.axis - 6;
    manifold.points[manifold.count++] = {edge_point(pair, edges / 3, edges % 3, least.normal),
                                         least.distance};
  }
  for (int i = 0; i < manifold.count; ++i) {
    manifold.points[i].point = transform_point(*frame, manifold.points[i].point);
  }
  return manifold;
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
