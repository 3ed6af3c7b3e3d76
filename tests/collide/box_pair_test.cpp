/// Tests of boxes against boxes, half-spaces and planes, with hand-computed values and against an
/// oracle in double that does not use separating axes.
#include <jfpx/collide.hpp>

#include "tests/collide/random_solids.hpp"
#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace jfpx {
namespace {

using test::operator""_r;
using test::kEps;

void expect_near(const Vec3& actual, const Vec3& expected, double tolerance = 16 * kEps) {
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(actual[i], expected[i], tolerance) << "xyz"[i];
}

Transform rotated_pose(const Vec3& axis_times_tangent, const Vec3& origin) {
  const Vec3& t = axis_times_tangent;
  return make_transform(normalized(Quat{1, t.x, t.y, t.z}), origin);
}

// ---------------------------------------------------------------------------------------------
// The oracle. Two convex polyhedra overlap if and only if an edge of one intersects the other: each
// corner of the intersection is a corner of one inside the other, or an intersection of an edge of
// one with a face of the other.

/// Three coordinates in double precision, with the index type of Vec3.
struct Double3 {
  double values[3];
  double& operator[](int i) { return values[i]; }
  double operator[](int i) const { return values[i]; }
};

struct PosedBox {
  double half[3], axis[3][3], centre[3];  // axis[k] is the k-th axis, in world coordinates

  /// @param margin added to the half extents; may be negative
  PosedBox(const Box& box, const Transform& pose, double margin) {
    for (int k = 0; k < 3; ++k) {
      half[k] = static_cast<double>(box.half_extents[k]) + margin;
      centre[k] = static_cast<double>(pose.origin[k]);
      for (int i = 0; i < 3; ++i) axis[k][i] = static_cast<double>(pose.basis(i, k));
    }
  }
  bool empty() const { return half[0] < 0 || half[1] < 0 || half[2] < 0; }
  Double3 to_local(const Double3& p) const {
    Double3 r{};
    for (int k = 0; k < 3; ++k) {
      for (int i = 0; i < 3; ++i) r[k] += axis[k][i] * (p[i] - centre[i]);
    }
    return r;
  }
  Double3 corner(int n) const {
    Double3 r{centre[0], centre[1], centre[2]};
    for (int k = 0; k < 3; ++k) {
      const double h = (n >> k & 1) != 0 ? half[k] : -half[k];
      for (int i = 0; i < 3; ++i) r[i] += h * axis[k][i];
    }
    return r;
  }
};

bool segment_meets(const PosedBox& box, const Double3& p, const Double3& q) {
  const auto a = box.to_local(p), b = box.to_local(q);
  double first = 0, last = 1;
  for (int k = 0; k < 3; ++k) {
    const double d = b[k] - a[k];
    for (const double side : {-1.0, 1.0}) {  // side * (a + t d) <= half
      const double room = box.half[k] - side * a[k], slope = side * d;
      if (slope > 0) {
        last = std::min(last, room / slope);
      } else if (slope < 0) {
        first = std::max(first, room / slope);
      } else if (room < 0) {
        return false;
      }
    }
  }
  return first <= last;
}

bool edge_meets(const PosedBox& a, const PosedBox& b) {
  for (int n = 0; n < 8; ++n) {
    for (int k = 0; k < 3; ++k) {
      if ((n >> k & 1) == 0 && segment_meets(b, a.corner(n), a.corner(n | 1 << k))) return true;
    }
  }
  return false;
}

bool overlap(const Box& a, const Transform& pose_a, const Box& b, const Transform& pose_b,
             double margin) {
  const PosedBox first(a, pose_a, margin), second(b, pose_b, margin);
  if (first.empty() || second.empty()) return false;
  return edge_meets(first, second) || edge_meets(second, first);
}

/// The overlap of two boxes along a direction; negative: a gap.
double overlap_along(const PosedBox& a, const PosedBox& b, const Double3& d) {
  double sum = 0, between = 0;
  for (int k = 0; k < 3; ++k) {
    double on_a = 0, on_b = 0;
    for (int i = 0; i < 3; ++i) on_a += a.axis[k][i] * d[i], on_b += b.axis[k][i] * d[i];
    sum += a.half[k] * std::abs(on_a) + b.half[k] * std::abs(on_b);
    between += d[k] * (a.centre[k] - b.centre[k]);
  }
  return sum - between;
}

// ---------------------------------------------------------------------------------------------

struct Case {
  Box a, b;
  Transform pose_a, pose_b;
};

Real log_uniform(Random* random, double low, double high) {
  return static_cast<Real>(
      std::exp(std::log(low) + (std::log(high) - std::log(low)) * random->uniform()));
}

Transform random_pose(Random* random, const Vec3& origin) {
  Quat q;
  do {
    q = {random->uniform(-1, 1), random->uniform(-1, 1), random->uniform(-1, 1),
         random->uniform(-1, 1)};
  } while (!(length_squared(q) > 0.01_r));
  return make_transform(normalized(q), origin);
}

/// Two boxes (cubes, plates or needles) in arbitrary, nearly parallel or parallel poses.
Case random_case(Random* random) {
  Case c;
  for (Box* box : {&c.a, &c.b}) {
    const double thinnest = random->below(2) == 0 ? 0.5 : 0.01;
    for (int i = 0; i < 3; ++i) box->half_extents[i] = log_uniform(random, thinnest, 2);
  }
  const Vec3 home = random->uniform_in_box({-5, -5, -5}, {5, 5, 5});
  c.pose_a = random_pose(random, home);
  // About half of the pairs are separated.
  const Vec3 range = c.a.half_extents + c.b.half_extents;
  const Vec3 offset = random->uniform_in_box(-range, range) * 1.2_r;
  const auto kind = random->below(4);
  if (kind == 0) {
    c.pose_b = {c.pose_a.basis, {}};
  } else if (kind == 1) {
    const Real tilt = log_uniform(random, 1e-6, 0.1);
    c.pose_b = c.pose_a *
               rotated_pose(random->uniform_in_box({-tilt, -tilt, -tilt}, {tilt, tilt, tilt}), {});
  } else {
    c.pose_b = random_pose(random, {});
  }
  c.pose_b.origin = home + c.pose_a.basis * offset;
  return c;
}

/// Bound of the error of a distance: rounding errors, which are larger if edges are nearly
/// parallel.
double tolerance(const Case& c) {
  double error = 1;  // in units of epsilon, relative to the size
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const double sine = length(cross(c.pose_a.basis.column(i), c.pose_b.basis.column(j)));
      // Below this the test skips the axis, and misses gaps of the order of the sine.
      const double skipped = 2 * std::sqrt(kEps);
      error = std::max(error, sine > skipped * 0.99 ? 1 / sine : sine / kEps);
    }
  }
  const double size = length(c.a.half_extents) + length(c.b.half_extents);
  return 40 * kEps * (size * error + length(c.pose_a.origin));
}

TEST(BoxBox, AgreesWithTheOracleInContactDepthAndDirection) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int touches = 0, clear = 0, edges = 0;
  for (int n = 0; n < 100000; ++n) {
    const Case c = random_case(&random);
    const double noise = tolerance(c);
    const Manifold m = collide(c.a, c.pose_a, c.b, c.pose_b);
    ASSERT_EQ(m.count > 0, overlap(c.a, c.pose_a, c.b, c.pose_b, m.count > 0 ? noise : -noise))
        << n << ": touches " << m.count;
    if (m.count == 0) {
      ++clear;
      continue;
    }
    ++touches;
    ASSERT_NEAR(length(m.normal), 1, 64 * kEps);
    ASSERT_LE(m.distance, 0);
    // Translated by the depth, the boxes only touch. A face is preferred to a pair of edges whose
    // depth is up to 2 % smaller.
    const auto moved = [&](double by) {
      Transform pose = c.pose_a;
      pose.origin += m.normal * static_cast<Real>(by);
      return pose;
    };
    const double depth = -static_cast<double>(m.distance);
    ASSERT_FALSE(overlap(c.a, moved(depth + 2 * noise), c.b, c.pose_b, -noise / 4)) << n;
    ASSERT_TRUE(overlap(c.a, moved(depth / 1.03 - 2 * noise), c.b, c.pose_b, noise)) << n;
    // In no direction is the depth smaller by more than the preference for faces.
    const PosedBox a(c.a, c.pose_a, 0), b(c.b, c.pose_b, 0);
    for (int k = 0; k < 20; ++k) {
      Double3 d;
      double norm = 0;
      for (double& x : d.values) x = random.uniform(-1, 1), norm += x * x;
      for (double& x : d.values) x /= std::sqrt(norm);
      ASSERT_GE(overlap_along(a, b, d), depth / 1.03 - noise) << n;
    }
    // The points lie in the overlap of the boxes, and none is deeper than the manifold.
    for (int k = 0; k < m.count; ++k) {
      const ManifoldPoint& p = m.points[k];
      ASSERT_LE(p.distance, 0);
      ASSERT_GE(p.distance, m.distance - noise);
      for (const PosedBox* box : {&a, &b}) {
        const auto local = box->to_local({p.point.x, p.point.y, p.point.z});
        for (int i = 0; i < 3; ++i) {
          ASSERT_LE(std::abs(local[i]), box->half[i] - p.distance / 2 + noise)
              << n << ", point " << k << " of " << m.count;
        }
      }
    }
    for (int k = m.count; k < 8; ++k) ASSERT_EQ(m.points[k], ManifoldPoint{});
    if (m.count == 1) ++edges;
  }
  EXPECT_GT(touches, 20000);
  EXPECT_GT(clear, 20000);
  EXPECT_GT(edges, 1000);
}

/// Rounding may leave all points of the faces above the contact, or, along an edge, no points.
TEST(BoxBox, FacesInExactContactHavePointsOnBothBoxes) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int touches = 0;
  for (int n = 0; n < 100000; ++n) {
    Case c = random_case(&random);
    c.pose_b = c.pose_a * test::touching_pose(c.a.half_extents, c.b.half_extents, &random);
    if (random.below(2) == 0) std::swap(c.a, c.b), std::swap(c.pose_a, c.pose_b);
    const double noise = tolerance(c);
    const Manifold m = collide(c.a, c.pose_a, c.b, c.pose_b);
    if (m.count == 0) continue;
    ++touches;
    const PosedBox a(c.a, c.pose_a, noise), b(c.b, c.pose_b, noise);
    for (int k = 0; k < m.count; ++k) {
      const Vec3& p = m.points[k].point;
      for (const PosedBox* box : {&a, &b}) {
        const auto local = box->to_local({p.x, p.y, p.z});
        for (int i = 0; i < 3; ++i) ASSERT_LE(std::abs(local[i]), box->half[i]) << n;
      }
    }
  }
  EXPECT_GT(touches, 20000);
}

TEST(BoxBox, SwappedOrTransformedBoxesHaveTheSameContact) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int touches = 0;
  for (int n = 0; n < 20000; ++n) {
    const Case c = random_case(&random);
    const double noise = tolerance(c);
    const Transform world = random_pose(&random, {1, 2, 3});
    const Manifold m = collide(c.a, c.pose_a, c.b, c.pose_b);
    const Manifold others[] = {collide(c.b, c.pose_b, c.a, c.pose_a),
                               collide(c.a, world * c.pose_a, c.b, world * c.pose_b)};
    for (const Manifold& other : others) {
      if (other.count == 0 || m.count == 0) {  // both, or the depth is within rounding errors
        ASSERT_GE(m.distance + other.distance, -4 * noise) << n;
        continue;
      }
      ++touches;
      ASSERT_NEAR(other.distance, m.distance, 4 * noise - 0.03 * static_cast<double>(m.distance));
    }
  }
  EXPECT_GT(touches, 8000);
}

/// The points of a manifold in a fixed order, for comparison with a list.
std::vector<ManifoldPoint> sorted(const Manifold& m) {
  std::vector<ManifoldPoint> points(m.points, m.points + m.count);
  std::ranges::sort(points, [](const ManifoldPoint& p, const ManifoldPoint& q) {
    return std::array{p.point.x, p.point.y, p.point.z} <
           std::array{q.point.x, q.point.y, q.point.z};
  });
  return points;
}

void expect_points(const Manifold& m, const std::vector<ManifoldPoint>& expected) {
  const auto points = sorted(m);
  ASSERT_EQ(points.size(), expected.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    expect_near(points[i].point, expected[i].point);
    EXPECT_NEAR(points[i].distance, expected[i].distance, 16 * kEps);
  }
}

TEST(BoxBox, AFaceOnAFaceGivesTheCornersOfTheirIntersection) {
  // A plate 4 x 1 x 4 with its top at y = 0, and a cube that penetrates it by 0.1 and extends over
  // one edge.
  const Manifold m = collide(Box{{0.5_r, 0.5_r, 0.5_r}}, {{}, {2, 0.4_r, 0}}, Box{{2, 0.5_r, 2}},
                             {{}, {0, -0.5_r, 0}});
  EXPECT_EQ(m.normal, (Vec3{0, 1, 0}));
  EXPECT_NEAR(m.distance, -0.1, 4 * kEps);
  expect_points(m, {{{1.5_r, -0.05_r, -0.5_r}, -0.1_r},
                    {{1.5_r, -0.05_r, 0.5_r}, -0.1_r},
                    {{2, -0.05_r, -0.5_r}, -0.1_r},
                    {{2, -0.05_r, 0.5_r}, -0.1_r}});
}

TEST(BoxBox, AFaceRotatedByAnEighthOnAFaceGivesEightPoints) {
  const Real tangent = static_cast<Real>(std::tan(3.14159265358979323846 / 8));
  const Manifold m = collide(Box{{1, 1, 1}}, rotated_pose({0, tangent, 0}, {0, 1.9_r, 0}),
                             Box{{1, 1, 1}}, Transform{});
  expect_near(m.normal, {0, 1, 0});
  ASSERT_EQ(m.count, 8);
  // The octagon: corners at (+-1, +-t) and (+-t, +-1) with t = sqrt(2) - 1.
  for (const ManifoldPoint& p : sorted(m)) {
    const double x = std::abs(p.point.x), z = std::abs(p.point.z);
    EXPECT_NEAR(std::max(x, z), 1, 16 * kEps);
    EXPECT_NEAR(std::min(x, z), std::sqrt(2.0) - 1, 16 * kEps);
    EXPECT_NEAR(p.point.y, 0.95, 16 * kEps);
    EXPECT_NEAR(p.distance, -0.1, 16 * kEps);
  }
}

TEST(BoxBox, CrossedEdgesGiveOnePoint) {
  // Both boxes stand on an edge, a along z and b along x, at the distance sqrt(2) from the centre.
  const Real t = static_cast<Real>(std::tan(3.14159265358979323846 / 8));
  const Real radius = square_root(2.0_r);
  const Manifold m =
      collide(Box{{1, 1, 5}}, rotated_pose({0, 0, t}, {0.3_r, 2 * radius - 0.2_r, 1}),
              Box{{5, 1, 1}}, rotated_pose({t, 0, 0}, {2, 0, 0.7_r}));
  expect_near(m.normal, {0, 1, 0});
  EXPECT_NEAR(m.distance, -0.2, 32 * kEps);
  ASSERT_EQ(m.count, 1);
  expect_near(m.points[0].point, {0.3_r, radius - 0.1_r, 0.7_r}, 32 * kEps);
}

/// In float, rounding selects a pair of edges, one of which does not reach the other.
TEST(BoxBox, EdgesThatDoNotCrossHaveAPointInTheOverlap) {
  const Box a{{0x1.b3824p-7_r, 0x1.8f4c1ep-2_r, 0x1.c5463ap-5_r}};
  const Box b{{0x1.4224acp-1_r, 0x1.2595dcp+0_r, 0x1.3d6cep-1_r}};
  const Transform pose_a{from_columns({-0x1.6a8354p-1_r, 0x1.17bb04p-2_r, 0x1.4d6a74p-1_r},
                                      {-0x1.4a1ea4p-1_r, 0x1.022bap-3_r, -0x1.820118p-1_r},
                                      {-0x1.26f41ep-2_r, -0x1.e84754p-1_r, 0x1.63dacp-4_r}),
                         {-0x1.23effp+2_r, -0x1.8fd1cp-2_r, -0x1.24dad8p+2_r}};
  const Transform pose_b{from_columns({-0x1.6a830ep-1_r, 0x1.17c2b4p-2_r, 0x1.4d6924p-1_r},
                                      {-0x1.4a1d7cp-1_r, 0x1.022d64p-3_r, -0x1.820202p-1_r},
                                      {-0x1.26faa8p-2_r, -0x1.e8462cp-1_r, 0x1.63e9d4p-4_r}),
                         {-0x1.411e6cp+2_r, 0x1.ac68fp-2_r, -0x1.3e965p+2_r}};
  const Manifold m = collide(a, pose_a, b, pose_b);
  ASSERT_GT(m.count, 0);
  for (int k = 0; k < m.count; ++k) {
    const Vec3 local = transform_transpose(pose_a.basis, m.points[k].point - pose_a.origin);
    for (int i = 0; i < 3; ++i) EXPECT_LE(absolute(local[i]), a.half_extents[i] + 0.001_r);
  }
}

TEST(BoxBox, AnyGapIsNoContact) {
  const Box cube{{1, 1, 1}};
  const Transform home;
  EXPECT_EQ(collide(cube, home, cube, {{}, {2 + 4 * kEpsilon, 0, 0}}), Manifold{});
  EXPECT_EQ(collide(cube, home, cube, {{}, {2, 0, 0}}).count, 4);  // touching is a contact
  EXPECT_EQ(collide(cube, home, cube, rotated_pose({0.3_r, 0.2_r, 0.1_r}, {9, 9, 9})), Manifold{});
  const Real nan = std::numeric_limits<Real>::quiet_NaN();
  EXPECT_EQ(collide(cube, home, cube, {{}, {nan, 0, 0}}), Manifold{});
}

TEST(BoxBox, CoincidentBoxesSeparateAlongX) {
  const Manifold m = collide(Box{{1, 2, 3}}, {}, Box{{1, 2, 3}}, {});
  EXPECT_EQ(m.normal, (Vec3{1, 0, 0}));
  EXPECT_EQ(m.distance, -2);
  EXPECT_EQ(m.count, 4);
}

TEST(Erratum, E15_boxes_overlap_at_any_position) {
  const Box cube{{1, 1, 1}};
  for (const Vec3& position : {Vec3{0, 0, 0}, Vec3{5, 0, 0}, Vec3{3, 4, 5}, Vec3{-100, 0, 7}}) {
    const Manifold m = collide(cube, {{}, position}, cube, {{}, position + Vec3{1, 0, 0}});
    EXPECT_EQ(m.normal, (Vec3{-1, 0, 0}));
    EXPECT_EQ(m.distance, -1);
    EXPECT_EQ(m.count, 4);
  }
}

TEST(Erratum, E16_a_sphere_behind_a_plane_is_pushed_to_the_side_of_its_centre) {
  // The centre is 0.4 behind the plane, so the overlap is 0.6, from the plane to y = 0.6.
  const Plane plane{{0, 1, 0}, 0};
  const Touch behind = collide(SphereInstance{{7, -0.4_r, 0}, 1}, plane);
  ASSERT_TRUE(behind.touching);
  EXPECT_EQ(behind.normal, (Vec3{0, -1, 0}));
  EXPECT_NEAR(behind.distance, -0.6, kEps);
  expect_near(behind.point, {7, 0.3_r, 0});
  const Touch before = collide(SphereInstance{{7, 0.4_r, 0}, 1}, plane);
  EXPECT_EQ(before.normal, (Vec3{0, 1, 0}));
  expect_near(before.point, {7, -0.3_r, 0});
  EXPECT_EQ(collide(SphereInstance{{7, 0, 0}, 1}, plane).normal, (Vec3{0, 1, 0}));
  EXPECT_TRUE(collide(SphereInstance{{0, -1, 0}, 1}, plane).touching);
  EXPECT_FALSE(collide(SphereInstance{{0, -1 - 2 * kEpsilon, 0}, 1}, plane).touching);
}

TEST(Erratum, E17_the_point_of_a_box_in_a_half_space_is_half_way_to_the_surface) {
  // Corners at y = -0.1.
  const Manifold m = collide(Box{{1, 2, 3}}, {{}, {10, 1.9_r, 0}}, HalfSpace{});
  EXPECT_EQ(m.normal, (Vec3{0, 1, 0}));
  EXPECT_NEAR(m.distance, -0.1, 2 * kEps);
  expect_points(m, {{{9, -0.05_r, -3}, -0.1_r},
                    {{9, -0.05_r, 3}, -0.1_r},
                    {{11, -0.05_r, -3}, -0.1_r},
                    {{11, -0.05_r, 3}, -0.1_r}});
}

TEST(BoxHalfSpace, EachCornerInsideHasItsOwnDepth) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int counts[9] = {};
  for (int n = 0; n < 20000; ++n) {
    const Box box{random.uniform_in_box({0.01_r, 0.1_r, 0.5_r}, {0.5_r, 1, 2})};
    const Transform pose = random_pose(&random, random.uniform_in_box({-2, -2, -2}, {2, 2, 2}));
    const HalfSpace solid{random_pose(&random, {}).basis.column(0), random.uniform(-1, 1)};
    const Manifold m = collide(box, pose, solid);
    const PosedBox posed(box, pose, 0);
    int inside = 0;
    double deepest = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const auto p = posed.corner(corner);
      double d = -static_cast<double>(solid.offset);
      for (int i = 0; i < 3; ++i) d += p[i] * static_cast<double>(solid.normal[i]);
      if (std::abs(d) < 40 * kEps) {
        inside = -1;  // within rounding errors
        break;
      }
      if (d > 0) continue;
      ++inside;
      deepest = std::min(deepest, d);
    }
    if (inside < 0) continue;
    ASSERT_EQ(m.count, inside);
    ++counts[inside];
    ASSERT_NEAR(m.distance, deepest, 40 * kEps);
    for (int k = 0; k < m.count; ++k) {
      const double d = dot(solid.normal, m.points[k].point) - solid.offset;
      ASSERT_NEAR(d, m.points[k].distance / 2, 40 * kEps);
    }
  }
  EXPECT_GT(counts[0], 0);
  EXPECT_GT(counts[1], 0);
  EXPECT_GT(counts[8], 0);
}

TEST(BoxPlane, PushesTheBoxToTheSideOfItsCentre) {
  const Box box{{1, 1, 1}};
  const Plane plane{{0, 1, 0}, 5};
  const Manifold above = collide(box, {{}, {0, 5.75_r, 0}}, plane);
  EXPECT_EQ(above.normal, (Vec3{0, 1, 0}));
  EXPECT_EQ(above.distance, -0.25_r);
  EXPECT_EQ(above.count, 4);
  const Manifold below = collide(box, {{}, {0, 4.25_r, 0}}, plane);
  EXPECT_EQ(below.normal, (Vec3{0, -1, 0}));
  EXPECT_EQ(below.distance, -0.25_r);
  EXPECT_EQ(below.points[0].point.y, 5.125_r);
  EXPECT_EQ(collide(box, {{}, {0, 6.5_r, 0}}, plane), Manifold{});
}

}  // namespace
}  // namespace jfpx
