/// Volume and centroid of the part of a polyhedron below a plane.
#pragma once

#include <jfpx/shape.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// The part of a solid below a plane, as sums over tetrahedra.
struct Submerged {
  Real volume = 0;  ///< [m^3]
  Vec3 moment;      ///< [m^4], volume times centroid
};

/// A corner of a tetrahedron; below the plane if height <= 0.
struct Corner {
  Vec3 point;       ///< [m]
  Real height = 0;  ///< [m], above the plane
};

JFPX_HD inline void add_tetrahedron(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d,
                                    Submerged* sum) {
  const Real volume = absolute(dot(b - a, cross(c - a, d - a))) / 6;
  sum->volume += volume;
  sum->moment += (a + b + c + d) * (volume / 4);
}

/// Intersection of the plane with the edge from a corner below to a corner above.
JFPX_HD constexpr Vec3 intersection(const Corner& below, const Corner& above) {
  return add_scaled(below.point, above.point - below.point,
                    below.height / (below.height - above.height));
}

/// Adds the prism between the triangles a and b, as three tetrahedra.
JFPX_HD inline void add_prism(const Vec3 (&a)[3], const Vec3 (&b)[3], Submerged* sum) {
  add_tetrahedron(a[0], a[1], a[2], b[0], sum);
  add_tetrahedron(a[1], a[2], b[0], b[1], sum);
  add_tetrahedron(a[2], b[0], b[1], b[2], sum);
}

/// Adds the part of a tetrahedron below the plane: a tetrahedron, or a prism if two or three
/// corners are below. Sorts the corners.
JFPX_HD inline void add_clipped(Corner (&c)[4], Submerged* sum) {
  int below = 0;
  for (Corner& corner : c) {
    if (corner.height > 0) continue;
    const Corner lower = corner;
    corner = c[below];
    c[below++] = lower;
  }
  if (below == 0) return;
  if (below == 4) {
    add_tetrahedron(c[0].point, c[1].point, c[2].point, c[3].point, sum);
  } else if (below == 1) {
    add_tetrahedron(c[0].point, intersection(c[0], c[1]), intersection(c[0], c[2]),
                    intersection(c[0], c[3]), sum);
  } else if (below == 2) {
    add_prism({c[0].point, intersection(c[0], c[2]), intersection(c[0], c[3])},
              {c[1].point, intersection(c[1], c[2]), intersection(c[1], c[3])}, sum);
  } else {
    add_prism({c[0].point, c[1].point, c[2].point},
              {intersection(c[0], c[3]), intersection(c[1], c[3]), intersection(c[2], c[3])}, sum);
  }
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
