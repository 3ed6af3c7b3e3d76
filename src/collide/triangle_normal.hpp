/// Normals of triangles, and whether two triangles are in one plane, in double precision.
#pragma once

#include <jfpx/math.hpp>

#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// A vector in double precision, in which differences and products of floats are exact or nearly
/// so.
struct Vec3d {
  double x, y, z;
};
JFPX_HD inline Vec3d difference(const Vec3& a, const Vec3& b) {
  return {static_cast<double>(a.x) - static_cast<double>(b.x),
          static_cast<double>(a.y) - static_cast<double>(b.y),
          static_cast<double>(a.z) - static_cast<double>(b.z)};
}
JFPX_HD inline double dot(const Vec3d& a, const Vec3d& b) {
  return (a.x * b.x + a.y * b.y) + a.z * b.z;
}
JFPX_HD inline Vec3d cross(const Vec3d& a, const Vec3d& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// Cross product of two edges, and its length.
struct TriangleArea {
  Vec3d normal;
  double size = 0;

  JFPX_HD TriangleArea(const Vec3& a, const Vec3& b, const Vec3& c)
      : normal(cross(difference(b, a), difference(c, b))), size(square_root(dot(normal, normal))) {}
  JFPX_HD Vec3 unit_normal() const {
    return {static_cast<Real>(normal.x / size), static_cast<Real>(normal.y / size),
            static_cast<Real>(normal.z / size)};
  }
};

/// Whether the height of a triangle is more than a small fraction of its longest edge.
inline bool has_area(const TriangleArea& area, const Vec3& a, const Vec3& b, const Vec3& c) {
  constexpr double kLeastHeight = 16.0 * static_cast<double>(kEpsilon);
  const auto length2 = [](const Vec3& p, const Vec3& q) {
    const Vec3d edge = difference(q, p);
    return dot(edge, edge);
  };
  const double longest = std::fmax(length2(a, b), std::fmax(length2(b, c), length2(c, a)));
  return area.size > kLeastHeight * longest;
}

/// Whether two triangles at an edge are in one plane, on different sides of the edge.
/// @param third,opposite their third vertices
inline bool are_flat(const Vec3& start, const Vec3& end, const Vec3& third, const Vec3& opposite) {
  /// Sine of the largest angle between triangles that are in the same plane. The surface of a box
  /// of 1 m is then at most 0.25 mm above an edge on which it has no point.
  constexpr double kFlatSine = 1e-3;
  const Vec3d along = difference(end, start);
  const Vec3d p = cross(along, difference(third, start));
  const Vec3d q = cross(along, difference(opposite, start));
  const Vec3d sine = cross(p, q);
  const double scale = dot(p, p) * dot(q, q);
  return dot(p, q) < 0 && dot(sine, sine) <= kFlatSine * kFlatSine * scale;
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
