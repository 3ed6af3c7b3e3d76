/// The axis of a contact of a polyhedron and a triangle, among the proximal normals of the mesh:
/// see mesh_triangle.hpp. A pair of a polyhedron and a triangle is a LocalTriangle with
///   - `kEdgeAxis`: number of the first axis that is the cross product of two edges;
///   - `lowest(axis)`: [m], least coordinate of the polyhedron along an axis;
///   - `edge_points(overlap)`: the closest points of the two edges of an axis; a solid without
///     edges has none;
///   - a function `for_each_axis(pair, visit)`.
#pragma once

#include "src/collide/box_pair.hpp"
#include "src/collide/mesh_triangle.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Numbers of axes: the normal of the triangle, and the first normal of a face of the polyhedron.
inline constexpr int kNormalAxis = 0, kFaceAxis = 1;

/// A triangle in the axes of a polyhedron.
struct LocalTriangle {
  Vec3 corner[3];  ///< [m]
  Vec3 normal;     ///< unit, to the side of the polyhedron
  std::uint32_t flat_edges = 0;
  Real size = 0;  ///< [m], the scale of the rounding errors

  /// @param shift  [m], world axes, motion of the polyhedron since the start of the step
  /// @param centre [m], of the polyhedron in its axes
  /// @param radius [m], of the polyhedron
  JFPX_HD void place(const Mat3& axes, const TriangleInstance& triangle, const Vec3& shift,
                     const Vec3& centre, Real radius) {
    normal = transform_transpose(axes, triangle.normal);
    flat_edges = triangle.mesh->flat_edges(triangle.triangle);
    Real farthest = 0;
    for (int k = 0; k < 3; ++k) {
      corner[k] = transform_transpose(axes, triangle.corner[k] - shift) + centre;
      const Real distance = length(corner[k]);
      farthest = distance > farthest ? distance : farthest;
    }
    size = radius + farthest;
  }
  JFPX_HD Vec3 edge(int k) const { return corner[next_corner(k)] - corner[k]; }
  /// [m], bound of the rounding error of a distance.
  JFPX_HD Real error() const { return 8 * kEpsilon * size; }
  /// [m], largest coordinate of the corners along an axis.
  JFPX_HD Real support(const Vec3& axis) const {
    const Real p = dot(axis, corner[0]), q = dot(axis, corner[1]), r = dot(axis, corner[2]);
    const Real pq = p < q ? q : p;
    return r > pq ? r : pq;
  }
};

/// Axes within a degree of each other form the same contact.
JFPX_HD inline bool are_parallel(const Vec3& a, const Vec3& b) {
  constexpr Real kParallelCosine = Real(0.9998);
  return dot(a, b) > kParallelCosine;
}

/// The feature of a triangle that is closest to a polyhedron along the normal of an overlap. An
/// edge within a degree of a right angle to the normal is closest with both ends: the polyhedron
/// rests on it with a face. kFace means that the normal is nearly that of the triangle, or
/// opposite.
JFPX_HD inline int supporting_feature(const Vec3 (&corner)[3], const LeastOverlap& overlap) {
  constexpr Real kSine = Real(0.02);
  Real height[3];
  for (int k = 0; k < 3; ++k) height[k] = dot(overlap.normal, corner[k]);
  int top = 0;
  for (int k = 1; k < 3; ++k) top = height[k] > height[top] ? k : top;
  int count = 0, below = 0;
  for (int k = 0; k < 3; ++k) {
    const Real drop = height[top] - height[k], error = 8 * overlap.error;
    const bool supports =
        drop <= error || drop * drop <= kSine * kSine * length_squared(corner[top] - corner[k]);
    count += supports ? 1 : 0;
    if (!supports) below = k;
  }
  if (count == 3) return kFace;
  return count == 2 ? kEdge + next_corner(below) : kVertex + top;
}

template <class Pair>
JFPX_HD LeastOverlap overlap_along_normal(const Pair& pair) {
  return {kNormalAxis, pair.lowest(pair.normal) - dot(pair.normal, pair.corner[0]), pair.error(),
          pair.normal};
}

/// False if an axis separates the shapes by more than `limit`. Otherwise writes the axis of the
/// largest separation, or of least overlap.
template <class Pair>
JFPX_HD bool widest_separation(const Pair& pair, Real limit, LeastOverlap* widest) {
  *widest = overlap_along_normal(pair);
  if (widest->distance > limit) return false;
  return for_each_axis(pair, [&](const LeastOverlap& overlap) {
    if (overlap.distance > widest->distance) *widest = overlap;
    return overlap.distance <= limit;
  });
}

/// Whether the polyhedron is closer to the face of a neighbor at a convex edge, which then has the
/// contact, than to the face of the triangle.
template <class Pair>
JFPX_HD bool is_nearer_to_neighbor(const Pair& pair, const TriangleInstance& triangle,
                                   const Mat3& axes, const LeastOverlap& normal) {
  bool is_nearer = false;
  triangle.visit_convex_neighbors([&](const Vec3& n) {
    const Vec3 axis = transform_transpose(axes, n);
    const LeastOverlap neighbor{kNormalAxis, pair.lowest(axis) - pair.support(axis), normal.error,
                                axis};
    is_nearer |= &preferred(normal, neighbor) == &neighbor;
  });
  return is_nearer;
}

/// Whether an axis is that of two edges that cross, or no cross product of two edges.
template <class Pair>
JFPX_HD bool has_points(const Pair& pair, const LeastOverlap& axis) {
  if constexpr (requires { pair.edge_points(axis); }) {
    return axis.axis < Pair::kEdgeAxis || pair.edge_points(axis).are_on(axis);
  } else {
    return true;
  }
}

/// The axis of least overlap among the proximal normals of the mesh. The normal of the triangle is
/// preferred to faces of the polyhedron, and these to edges; axes within a degree of the normal of
/// the triangle do not replace it, so that a body that rests on a flat mesh has the same normal on
/// all triangles.
template <class Pair>
JFPX_HD LeastOverlap proximal_axis(const Pair& pair, const TriangleInstance& triangle,
                                   const Mat3& axes) {
  const LeastOverlap normal = overlap_along_normal(pair);
  LeastOverlap faces, edges;
  for_each_axis(pair, [&](const LeastOverlap& overlap) {
    LeastOverlap* best = overlap.axis < Pair::kEdgeAxis ? &faces : &edges;
    if (best->axis >= 0 && !(overlap.distance > best->distance)) return true;
    if (!(overlap.distance > normal.distance)) return true;
    if (are_parallel(overlap.normal, pair.normal)) return true;
    const int feature = supporting_feature(pair.corner, overlap);
    if (feature == kFace) return true;
    if (overlap.distance < 0 && !has_points(pair, overlap)) return true;
    if (triangle.is_proximal(feature, axes * overlap.normal)) *best = overlap;
    return true;
  });
  // If the best pair of edges has the normal of a face, the next pair is not tried: its edges do
  // not cross, or the face has more of the contact.
  const LeastOverlap& face = preferred(normal, faces);
  const bool is_of_face = edges.axis >= 0 && are_parallel(edges.normal, face.normal);
  return is_of_face ? face : preferred(face, edges);
}

/// Writes the axis of the contact. The widest axis may be no proximal normal: a neighbor is closer
/// to the polyhedron in this direction. If the shapes are separated, the triangle has no contact
/// then.
/// @param widest of widest_separation()
/// @returns false if the triangle has no contact
template <class Pair>
JFPX_HD bool find_contact_axis(const Pair& pair, const TriangleInstance& triangle, const Mat3& axes,
                               const LeastOverlap& widest, LeastOverlap* axis) {
  const LeastOverlap chosen = *axis = proximal_axis(pair, triangle, axes);
  if (&preferred(chosen, widest) == &chosen) return true;
  if (are_parallel(chosen.normal, widest.normal)) return true;
  if (widest.distance > 0 && chosen.distance < 0) return false;
  return chosen.axis != kNormalAxis || !is_nearer_to_neighbor(pair, triangle, axes, chosen);
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
