/// Points for tests of hulls, and independent checks: the faces by brute force, and what every hull
/// promises.
#pragma once

#include <jfpx/error.hpp>
#include <jfpx/hull.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <tuple>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

using HullPoints = std::vector<Vec3>;

inline Real real(double x) { return static_cast<Real>(x); }

inline HullPoints box_corners(const Vec3& lower, const Vec3& upper) {
  HullPoints points;
  for (unsigned i = 0; i < 8; ++i) {
    points.push_back({(i & 1u) != 0 ? upper.x : lower.x, (i & 2u) != 0 ? upper.y : lower.y,
                      (i & 4u) != 0 ? upper.z : lower.z});
  }
  return points;
}
/// Two regular polygons at z = -1 and z = 1.
inline HullPoints prism(int sides) {
  HullPoints points;
  for (int i = 0; i < sides; ++i) {
    const double angle = 2 * 3.14159265358979323846 * i / sides;
    for (const double z : {-1.0, 1.0}) {
      points.push_back({real(std::cos(angle)), real(std::sin(angle)), real(z)});
    }
  }
  return points;
}
inline std::vector<std::vector<std::uint32_t>> face_lists(const Hull& hull) {
  std::vector<std::vector<std::uint32_t>> lists;
  for (const HullFace& face : hull.faces()) {
    const auto corners = hull.corners(face);
    lists.emplace_back(corners.begin(), corners.end());
  }
  return lists;
}
template <class... Arguments>
std::string hull_fault(const Arguments&... arguments) {
  try {
    const Hull hull(arguments...);
    return "no error";
  } catch (const InvalidArgument& error) {
    return error.what();
  }
}

using HullPoint = std::array<long double, 3>;
inline HullPoint hull_point(const Vec3& v) {
  return {static_cast<long double>(v.x), static_cast<long double>(v.y),
          static_cast<long double>(v.z)};
}
inline HullPoint operator-(const HullPoint& a, const HullPoint& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline HullPoint hull_cross(const HullPoint& a, const HullPoint& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline long double hull_dot(const HullPoint& a, const HullPoint& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// A face as the set of its vertices.
using FaceSet = std::set<std::tuple<Real, Real, Real>>;
inline std::tuple<Real, Real, Real> hull_key(const Vec3& v) { return {v.x, v.y, v.z}; }

/// The points of a plane set that are not between or inside others: extreme in some direction. A
/// point is not extreme if it lies in a triangle of others or on a segment between two others.
inline bool is_extreme(const HullPoint& p, const std::vector<HullPoint>& plane,
                       const HullPoint& normal) {
  // Extreme if a line through p and another point has all points on one side, and p is an end of
  // it.
  for (const HullPoint& q : plane) {
    if (q == p) continue;
    const HullPoint across = hull_cross(normal, q - p);
    bool is_end = true, is_side = true;
    for (const HullPoint& r : plane) {
      const long double side = hull_dot(across, r - p);
      is_side = is_side && side >= 0;
      is_end = is_end && (side != 0 || hull_dot(q - p, r - p) >= 0);
    }
    if (is_side && is_end) return true;
  }
  return false;
}

/// The faces of the hull of points for which products of three differences of coordinates are exact
/// in long double, in O(n^4). Empty if the points are coplanar.
inline std::set<FaceSet> faces_by_brute_force(const std::vector<Vec3>& points) {
  std::set<FaceSet> faces;
  const std::size_t n = points.size();
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      for (std::size_t k = j + 1; k < n; ++k) {
        if (i >= j && i <= k) continue;
        const HullPoint a = hull_point(points[i]);
        const HullPoint normal = hull_cross(hull_point(points[j]) - a, hull_point(points[k]) - a);
        if (hull_dot(normal, normal) == 0) continue;
        bool in_front = false, behind = false;
        std::vector<HullPoint> plane;
        for (const Vec3& v : points) {
          const long double height = hull_dot(normal, hull_point(v) - a);
          in_front = in_front || height > 0;
          behind = behind || height < 0;
          if (height == 0) plane.push_back(hull_point(v));
        }
        if (in_front == behind) continue;
        FaceSet face;
        for (const Vec3& v : points) {
          if (hull_dot(normal, hull_point(v) - a) != 0) continue;
          if (is_extreme(hull_point(v), plane, normal)) face.insert(hull_key(v));
        }
        faces.insert(face);
      }
    }
  }
  return faces;
}

inline std::set<FaceSet> face_sets(const Hull& hull) {
  std::set<FaceSet> faces;
  for (const HullFace& face : hull.faces()) {
    FaceSet set;
    for (const std::uint8_t corner : hull.corners(face)) {
      set.insert(hull_key(hull.vertices()[corner]));
    }
    faces.insert(set);
  }
  return faces;
}

/// [m], rounding unit of the largest coordinate.
inline long double hull_unit(std::span<const Vec3> points) {
  Real most = 0;
  for (const Vec3& v : points) {
    most = std::max({most, absolute(v.x), absolute(v.y), absolute(v.z)});
  }
  return static_cast<long double>(most) * static_cast<long double>(kEpsilon);
}

/// Checks edges, counts and canonical order.
inline void expect_closed(const Hull& hull) {
  const std::size_t vertices = hull.vertices().size(), faces = hull.faces().size();
  ASSERT_GE(vertices, 4u);
  ASSERT_LE(vertices, Hull::kMaxVertices);
  ASSERT_LE(faces, Hull::kMaxFaces);
  ASSERT_LE(hull.edges().size(), Hull::kMaxEdges);
  EXPECT_EQ(vertices + faces, hull.edges().size() + 2);
  EXPECT_EQ(hull.corners().size(), 2 * hull.edges().size());
  for (std::size_t i = 1; i < vertices; ++i) {
    EXPECT_LT(hull_key(hull.vertices()[i - 1]), hull_key(hull.vertices()[i]));
  }
  std::map<std::pair<unsigned, unsigned>, std::size_t> face_of;
  std::vector<int> counts(vertices);
  std::vector<std::vector<std::uint8_t>> lists;
  std::size_t first = 0;
  for (std::size_t f = 0; f < faces; ++f) {
    const HullFace& face = hull.faces()[f];
    EXPECT_EQ(face.first_corner, first);
    first += face.corner_count;
    const auto corners = hull.corners(face);
    lists.emplace_back(corners.begin(), corners.end());
    EXPECT_EQ(std::ranges::min_element(corners) - corners.begin(), 0);
    for (std::size_t i = 0; i < corners.size(); ++i) {
      ++counts[corners[i]];
      const bool is_new =
          face_of.try_emplace({corners[i], corners[(i + 1) % corners.size()]}, f).second;
      EXPECT_TRUE(is_new);
    }
  }
  EXPECT_TRUE(std::ranges::is_sorted(lists));
  for (const int count : counts) EXPECT_GE(count, 3);
  std::pair<unsigned, unsigned> last{0, 0};
  for (const HullEdge& edge : hull.edges()) {
    const std::pair<unsigned, unsigned> ends{edge.a, edge.b};
    EXPECT_LT(edge.a, edge.b);
    EXPECT_LT(last, ends);
    last = ends;
    ASSERT_TRUE(face_of.contains(ends) && face_of.contains({edge.b, edge.a}));
    EXPECT_EQ(face_of.at(ends), edge.left_face);
    EXPECT_EQ(face_of.at({edge.b, edge.a}), edge.right_face);
  }
}

/// Checks planes and convexity.
inline void expect_convex(const Hull& hull) {
  const long double unit = hull_unit(hull.vertices());
  for (const HullFace& face : hull.faces()) {
    const HullPoint normal = hull_point(face.normal);
    EXPECT_NEAR(static_cast<double>(std::sqrt(hull_dot(normal, normal))), 1,
                2 * static_cast<double>(kEpsilon));
    const auto offset = static_cast<long double>(face.offset);
    long double highest = -std::numeric_limits<long double>::infinity();
    for (const Vec3& v : hull.vertices()) {
      highest = std::max(highest, hull_dot(normal, hull_point(v)) - offset);
    }
    // A long double may round the sum.
    EXPECT_LE(highest, unit * 1e-3L);
    EXPECT_GE(highest,
              -2 * unit - static_cast<long double>(std::numeric_limits<Real>::denorm_min()));
    const auto corners = hull.corners(face);
    const auto corner = [&](std::size_t i) {
      return hull_point(hull.vertices()[corners[i % corners.size()]]);
    };
    for (std::size_t i = 0; i < corners.size(); ++i) {
      EXPECT_GE(hull_dot(normal, corner(i)) - offset, -40 * unit);
      const HullPoint turn = hull_cross(corner(i + 1) - corner(i), corner(i + 2) - corner(i + 1));
      EXPECT_GT(hull_dot(normal, turn), 0);
    }
  }
  EXPECT_GT(hull.volume(), 0);
}

/// Checks everything that the hull of points promises.
inline void expect_hull_of(const Hull& hull, const std::vector<Vec3>& points) {
  ASSERT_NO_FATAL_FAILURE(expect_closed(hull));
  expect_convex(hull);
  const long double unit = hull_unit(points);
  std::set<std::tuple<Real, Real, Real>> given;
  for (const Vec3& v : points) given.insert(hull_key(v));
  for (const Vec3& v : hull.vertices()) EXPECT_TRUE(given.contains(hull_key(v)));
  for (const HullFace& face : hull.faces()) {
    long double highest = 0;
    for (const Vec3& v : points) {
      highest = std::max(highest, hull_dot(hull_point(face.normal), hull_point(v)) -
                                      static_cast<long double>(face.offset));
    }
    EXPECT_LE(highest, 132 * unit);
  }
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
