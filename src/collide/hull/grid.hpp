/// Points rounded to integers, for exact geometry: |coordinate| <= 2^51, so that differences of
/// coordinates are exact, and products of three neither overflow nor underflow.
#pragma once

#include <jfpx/math.hpp>

#include "src/collide/hull/exact_sum.hpp"

#include <cmath>
#include <compare>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// A point or vector in double.
struct GridPoint {
  double x = 0, y = 0, z = 0;
  friend auto operator<=>(const GridPoint&, const GridPoint&) = default;
};
inline GridPoint operator+(const GridPoint& a, const GridPoint& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline GridPoint operator-(const GridPoint& a, const GridPoint& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline GridPoint operator*(const GridPoint& a, double s) { return {a.x * s, a.y * s, a.z * s}; }
inline double dot(const GridPoint& a, const GridPoint& b) {
  return (a.x * b.x + a.y * b.y) + a.z * b.z;
}
inline double length(const GridPoint& a) { return square_root(dot(a, a)); }
/// Cross product of differences of points, each component to a few units in the last place.
inline GridPoint cross(const GridPoint& a, const GridPoint& b) {
  return {product_difference(a.y, b.z, a.z, b.y), product_difference(a.z, b.x, a.x, b.z),
          product_difference(a.x, b.y, a.y, b.x)};
}

/// A triangle of grid points, counter-clockwise as seen from the front.
struct GridTriangle {
  GridPoint a, b, c;
  GridPoint normal;  ///< of length `size`
  double size = 0;   ///< twice the area; 0 if and only if the points are collinear

  GridTriangle() = default;
  GridTriangle(const GridPoint& first, const GridPoint& second, const GridPoint& third)
      : a(first),
        b(second),
        c(third),
        normal(cross(second - first, third - first)),
        size(length(normal)) {}
  /// Signed distance of a point from the plane, > 0 in front. The sign is exact; the error of the
  /// value is below 2^-49 times the distance of the point from `a`.
  double height(const GridPoint& p) const {
    const GridPoint d = p - a;
    const double x = normal.x * d.x, y = normal.y * d.y, z = normal.z * d.z;
    const double sum = (x + y) + z;
    // The relative errors are 4u of a component of the normal, u of a product and 2u of the sum.
    const double error = kErrorBound * ((std::abs(x) + std::abs(y)) + std::abs(z));
    if (std::abs(sum) > error) return sum / size;
    return exact_side(p) * (error / size);
  }
  /// -1, 0 or 1: behind, on or in front of the plane.
  int exact_side(const GridPoint& p) const { return determinant(p).sign(); }
  /// Six times the signed volume of the tetrahedron with a point, > 0 in front.
  ExactSum determinant(const GridPoint& p) const {
    const GridPoint u = b - a, v = c - a, w = p - a;
    ExactSum sum;
    sum.add_product(u.y, v.z, w.x);
    sum.add_product(-u.z, v.y, w.x);
    sum.add_product(u.z, v.x, w.y);
    sum.add_product(-u.x, v.z, w.y);
    sum.add_product(u.x, v.y, w.z);
    sum.add_product(-u.y, v.x, w.z);
    return sum;
  }

  static constexpr double kErrorBound = 0x1p-49;
};

/// Distance of a point from a triangle that is not degenerate: from the plane if the point projects
/// into the triangle, otherwise from the closest edge.
double distance(const GridPoint& p, const GridTriangle& triangle);

/// The common scale of points.
struct HullGrid {
  int exponent = 0;    ///< the spacing is 2^exponent [m]
  double largest = 0;  ///< [spacings], largest absolute coordinate

  /// @param points finite
  explicit HullGrid(std::span<const Vec3> points);
  GridPoint rounded(const Vec3& v) const;
  /// [m]
  double metres(double spacings) const { return std::ldexp(spacings, exponent); }
  /// Rounding unit of coordinates of the size of the largest.
  double unit() const { return largest * static_cast<double>(kEpsilon); }
  /// Points closer to the hull of the others are not vertices.
  double vertex_tolerance() const { return 64 * unit(); }
  /// Corners of a face may be behind its plane by this.
  double face_tolerance() const { return 32 * unit(); }
};

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
