/// Oracle for the distance of two convex bodies, in double and from their corners alone, without
/// faces, edges or separating axes.
#pragma once

#include <jfpx/config.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

using Point = std::array<double, 3>;

inline Point operator-(const Point& a, const Point& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline double dot(const Point& a, const Point& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// The point of the convex hull of `points` (one to four) that is closest to the origin, and the
/// smallest subset that contains it, which replaces `points`. Tests every subset: the closest point
/// of its affine hull must be a convex combination.
inline Point nearest_of_simplex(std::vector<Point>* points) {
  const auto n = points->size();
  double best = std::numeric_limits<double>::infinity();
  Point nearest{};
  std::vector<Point> subset, chosen;
  for (unsigned mask = 1; mask < 1u << n; ++mask) {
    subset.clear();
    for (unsigned i = 0; i < n; ++i) {
      if ((mask >> i & 1) != 0) subset.push_back((*points)[i]);
    }
    // Minimises |p0 + sum t_k e_k|^2: the normal equations, by Gaussian elimination with pivoting.
    const std::size_t k = subset.size() - 1;
    double m[3][4] = {};
    for (std::size_t i = 0; i < k; ++i) {
      for (std::size_t j = 0; j < k; ++j) {
        m[i][j] = dot(subset[i + 1] - subset[0], subset[j + 1] - subset[0]);
      }
      m[i][3] = -dot(subset[i + 1] - subset[0], subset[0]);
    }
    // Affinely dependent points are skipped, because a smaller subset has the same minimum.
    double size = 0;
    for (std::size_t i = 0; i < k; ++i) size = std::max(size, m[i][i]);
    bool regular = true;
    for (std::size_t c = 0; c < k && regular; ++c) {
      std::size_t pivot = c;
      for (std::size_t r = c; r < k; ++r) {
        if (std::abs(m[r][c]) > std::abs(m[pivot][c])) pivot = r;
      }
      std::swap(m[c], m[pivot]);
      regular = std::abs(m[c][c]) > 1e-13 * size;
      for (std::size_t r = 0; r < k && regular; ++r) {
        if (r == c) continue;
        const double f = m[r][c] / m[c][c];
        for (std::size_t j = c; j < 4; ++j) m[r][j] -= f * m[c][j];
      }
    }
    if (!regular) continue;
    double first = 1;
    Point p = subset[0];
    bool inside = true;
    for (std::size_t i = 0; i < k; ++i) {
      const double t = m[i][3] / m[i][i];
      first -= t;
      inside = inside && t >= 0;
      for (std::size_t x = 0; x < 3; ++x) p[x] += t * (subset[i + 1][x] - subset[0][x]);
    }
    if (!inside || first < 0 || !(dot(p, p) < best)) continue;
    best = dot(p, p);
    nearest = p;
    chosen = subset;
  }
  *points = chosen;
  return nearest;
}

/// The vector between the closest points, from b to a; zero if the bodies overlap. Uses the
/// algorithm of Gilbert, Johnson and Keerthi (1988) on the differences of corners.
inline Point separation(std::span<const Point> a, std::span<const Point> b) {
  const auto farthest = [](std::span<const Point> points, const Point& d, double sign) {
    const Point* best = &points[0];
    for (const Point& p : points) {
      if (sign * dot(p, d) > sign * dot(*best, d)) best = &p;
    }
    return *best;
  };
  std::vector<Point> simplex{a[0] - b[0]};
  Point v = simplex[0];
  for (int n = 0; n < 100; ++n) {
    const double squared = dot(v, v);
    if (squared == 0) return v;
    // The support point of the differences in the direction -v.
    const Point w = farthest(a, v, -1) - farthest(b, v, 1);
    if (squared - dot(v, w) <= 1e-14 * squared) return v;
    if (std::ranges::find(simplex, w) != simplex.end()) return v;
    simplex.push_back(w);
    const Point next = nearest_of_simplex(&simplex);
    if (simplex.size() == 4) return {};
    if (!(dot(next, next) < squared)) return v;
    v = next;
  }
  return v;
}

inline double length(const Point& p) { return std::sqrt(dot(p, p)); }

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
