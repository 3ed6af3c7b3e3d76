/// Scale of grids and distances of points.
#include "src/collide/hull/grid.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {
namespace {

double distance_from_segment(const GridPoint& p, const GridPoint& a, const GridPoint& b) {
  const GridPoint along = b - a, from_a = p - a, from_b = p - b;
  if (!(dot(along, from_a) > 0)) return length(from_a);
  if (!(dot(along, from_b) < 0)) return length(from_b);
  return length(cross(along, from_a)) / length(along);
}

/// Nearest integer of a number of at most 2^51: the sum has a unit in the last place of 1.
double nearest_integer(double x) {
  constexpr double kShift = 6755399441055744.0;  // 1.5 * 2^52
  return (x + kShift) - kShift;
}

}  // namespace

double distance(const GridPoint& p, const GridTriangle& t) {
  const GridPoint n = t.normal * (1 / t.size);
  const auto is_left = [&](const GridPoint& from, const GridPoint& to) {
    return dot(n, cross(to - from, p - from)) >= 0;
  };
  if (is_left(t.a, t.b) && is_left(t.b, t.c) && is_left(t.c, t.a)) return std::abs(t.height(p));
  return std::min({distance_from_segment(p, t.a, t.b), distance_from_segment(p, t.b, t.c),
                   distance_from_segment(p, t.c, t.a)});
}

HullGrid::HullGrid(std::span<const Vec3> points) {
  Real most = 0;
  for (const Vec3& p : points) {
    most = std::max({most, absolute(p.x), absolute(p.y), absolute(p.z)});
  }
  int bits = 0;
  const double fraction = std::frexp(static_cast<double>(most), &bits);
  exponent = bits - 51;
  largest = std::ldexp(fraction, 51);
}

GridPoint HullGrid::rounded(const Vec3& v) const {
  const auto coordinate = [this](Real x) {
    return nearest_integer(std::ldexp(static_cast<double>(x), -exponent)) + 0.0;
  };
  return {coordinate(v.x), coordinate(v.y), coordinate(v.z)};
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
