/// Polyhedra as lists of faces on grid points: deviation from convexity, and merging of faces.
#pragma once

#include "src/collide/hull/grid.hpp"

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Indices of the corners of a face, counter-clockwise as seen from outside.
using FaceCorners = std::vector<int>;

/// A closed surface that consists of polygons.
struct Polyhedron {
  std::vector<GridPoint> points;
  std::vector<FaceCorners> faces;

  const GridPoint& point(int i) const { return points[static_cast<std::size_t>(i)]; }
  /// Normal of a polygon by Newell's method; its length is twice the area. The sum begins at the
  /// corner with the smallest index, so it is a function of the cycle.
  GridPoint normal(const FaceCorners& face) const;
  /// The plane with the normal of the face that touches the polyhedron.
  /// @return the distance of the farthest corner of the face behind it
  double deviation(const FaceCorners& face) const;
  /// The least height of a corner over the line of its neighbours, and of the triangles of a fan
  /// over their base; > 0 if and only if the polygon is strictly convex, seen along its normal.
  double least_corner(const FaceCorners& face) const;
  /// Number of faces at each point.
  std::vector<int> face_counts() const;
};

/// The cycle that begins with its smallest index.
FaceCorners canonical_cycle(const FaceCorners& corners);

/// Merges neighbouring faces, those with the least deviation first, while
/// * all corners of the merged face are at most `tolerance` behind its plane,
/// * the merged face is strictly convex, seen along its normal,
/// * all vertices keep at least three faces, and no two faces have more in common than an edge.
/// Each merge removes one face and one edge, so V - E + F stays the same.
/// @return whether any faces were merged
bool merge_faces(Polyhedron* polyhedron, double tolerance);

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
