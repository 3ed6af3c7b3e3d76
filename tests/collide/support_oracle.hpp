/// Oracle for the separation of two convex solids, in double and from their farthest points alone:
/// the largest separation among many directions, improved by a random search.
#pragma once

#include <jfpx/random.hpp>

#include "src/collide/shapes.hpp"
#include "tests/collide/convex_distance.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

inline Point to_point(const Vec3& v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}
inline Vec3 to_vec3(const Point& p) {
  return {static_cast<Real>(p[0]), static_cast<Real>(p[1]), static_cast<Real>(p[2])};
}
inline Point scaled(const Point& p, double by) { return {p[0] * by, p[1] * by, p[2] * by}; }
inline Point sum(const Point& a, const Point& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }

/// A solid by its farthest points.
class SupportSolid {
 public:
  SupportSolid(const SolidShape& shape, const Transform& pose)
      : shape_(shape), origin_(to_point(pose.origin)) {
    for (int i = 0; i < 3; ++i) axes_[i] = to_point(pose.basis.column(i));
  }
  /// The convex hull of points in the world.
  explicit SupportSolid(const std::vector<Vec3>& points) : axes_{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}} {
    for (const Vec3& p : points) points_.push_back(to_point(p));
  }
  /// [m], farthest coordinate along a direction.
  double reach(const Point& d) const {
    if (!points_.empty()) {
      double most = -1e300;
      for (const Point& p : points_) most = std::max(most, dot(p, d));
      return most;
    }
    const Point local{dot(axes_[0], d), dot(axes_[1], d), dot(axes_[2], d)};
    return dot(origin_, d) + std::visit([&](const auto& s) { return reach_of(s, local); }, shape_);
  }
  const Point* axes() const { return axes_; }
  void translate(const Point& by) {
    origin_ = sum(origin_, by);
    for (Point& p : points_) p = sum(p, by);
  }

 private:
  static double wide(Real x) { return static_cast<double>(x); }
  static double reach_of(const Sphere& s, const Point& d) { return wide(s.radius) * length(d); }
  static double reach_of(const Box& s, const Point& d) {
    const Point h = to_point(s.half_extents);
    return h[0] * std::abs(d[0]) + h[1] * std::abs(d[1]) + h[2] * std::abs(d[2]);
  }
  static double reach_of(const Capsule& s, const Point& d) {
    return wide(s.half_height) * std::abs(d[1]) + wide(s.radius) * length(d);
  }
  static double reach_of(const Hull& s, const Point& d) {
    double most = -1e300;
    for (const Vec3& v : s.vertices()) most = std::max(most, dot(to_point(v), d));
    return most;
  }
  static double reach_of(const Cylinder& s, const Point& d) {
    return wide(s.half_height) * std::abs(d[1]) + wide(s.radius) * std::hypot(d[0], d[2]);
  }
  static double reach_of(const Cone& s, const Point& d) {
    const double h = wide(s.half_height);
    return std::max(1.5 * h * d[1], wide(s.radius) * std::hypot(d[0], d[2]) - 0.5 * h * d[1]);
  }

  SolidShape shape_;
  Point origin_{}, axes_[3];
  std::vector<Point> points_;
};

/// [m], separation along a direction from b to a.
inline double separation_along(const SupportSolid& a, const SupportSolid& b, const Point& n) {
  return -a.reach(scaled(n, -1)) - b.reach(n);
}

/// [m], lower bound of the largest separation, close to it.
inline double largest_separation(const SupportSolid& a, const SupportSolid& b, Random* random) {
  struct Tried {
    double separation;
    Point n;
  };
  std::vector<Tried> tried;
  const auto attempt = [&](const Point& n) {
    tried.push_back({separation_along(a, b, n), n});
    tried.push_back({separation_along(a, b, scaled(n, -1)), scaled(n, -1)});
  };
  for (int i = 0; i < 3; ++i) {
    attempt(a.axes()[i]);
    attempt(b.axes()[i]);
  }
  constexpr int kDirections = 1500;
  for (int i = 0; i < kDirections; ++i) {
    const double y = 1 - (2 * i + 1.0) / kDirections, r = std::sqrt(1 - y * y);
    tried.push_back({0, {r * std::cos(2.399963 * i), y, r * std::sin(2.399963 * i)}});
    tried.back().separation = separation_along(a, b, tried.back().n);
  }
  const auto more = [](const Tried& x, const Tried& y) { return x.separation > y.separation; };
  constexpr int kStarts = 6;
  std::partial_sort(tried.begin(), tried.begin() + kStarts, tried.end(), more);
  double best = tried[0].separation;
  for (int i = 0; i < kStarts; ++i) {
    Tried at = tried[static_cast<std::size_t>(i)];
    int failures = 0;
    for (double step = 0.1; step > 1e-7;) {
      const auto draw = [&] { return step * static_cast<double>(random->uniform(-1, 1)); };
      const Point n = sum(at.n, {draw(), draw(), draw()});
      const Point unit = scaled(n, 1 / length(n));
      const double separation = separation_along(a, b, unit);
      if (separation > at.separation) {
        at = {separation, unit};
        failures = 0;
      } else if (++failures == 12) {
        step *= 0.5;
        failures = 0;
      }
    }
    best = std::max(best, at.separation);
  }
  return best;
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
