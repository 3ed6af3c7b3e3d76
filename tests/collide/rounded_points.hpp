/// Any solid as points and a radius, for the convex distance in double.
#pragma once

#include "src/collide/shapes.hpp"
#include "tests/collide/convex_distance.hpp"

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// A solid as the convex hull of points in the world, with a radius around it.
struct RoundedPoints {
  std::vector<Point> points;
  double radius = 0;

  RoundedPoints(const SolidShape& solid, const Transform& pose) {
    if (const auto* hull = std::get_if<Hull>(&solid)) {
      for (const Vec3& v : hull->vertices()) add(pose, v);
      return;
    }
    const detail::Solid core = std::visit([](const auto& s) { return detail::to_solid(s); }, solid);
    radius = static_cast<double>(core.radius);
    for (int n = 0; n < 8; ++n) {
      Vec3 v = core.half_extents;
      for (int i = 0; i < 3; ++i) v[i] = (n >> i & 1) != 0 ? v[i] : -v[i];
      add(pose, v);
    }
  }
  void add(const Transform& pose, const Vec3& v) {
    const auto wide = [](Real x) { return static_cast<double>(x); };
    Point p{};
    for (int i = 0; i < 3; ++i) {
      const Vec3& row = pose.basis.row[i];
      p[static_cast<std::size_t>(i)] = wide(pose.origin[i]) + wide(row.x) * wide(v.x) +
                                       wide(row.y) * wide(v.y) + wide(row.z) * wide(v.z);
    }
    points.push_back(p);
  }
  void move(const Vec3& by) {
    for (Point& p : points) {
      for (std::size_t i = 0; i < 3; ++i) p[i] += static_cast<double>(by[static_cast<int>(i)]);
    }
  }
};

/// Distance of the hulls without their radii; 0 if these overlap.
inline double core_gap(const RoundedPoints& a, const RoundedPoints& b) {
  return length(separation(a.points, b.points));
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
