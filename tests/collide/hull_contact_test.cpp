/// Tests of the contacts of hulls against a convex distance in double, and of hulls with the
/// vertices of a box against boxes.
#include <jfpx/collide.hpp>

#include "src/world/bodies/sub_shape_view.hpp"
#include "tests/collide/random_solids.hpp"
#include "tests/collide/rounded_points.hpp"

#include <gtest/gtest.h>

namespace jfpx {
namespace {

using test::operator""_r;
using test::contact_between;
using test::core_gap;
using test::partner;
using test::RoundedPoints;

Real deepest(const detail::PairManifold& manifold) {
  Real distance = 0;
  for (std::uint32_t k = 0; k < manifold.touch_count; ++k) {
    distance = std::min(distance, manifold.touches[k].distance);
  }
  return distance;
}

TEST(HullContact, HasTheDepthOfTheOracleWithEverySolid) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int touching[4] = {}, deep[4] = {}, missed = 0;
  for (int n = 0; n < 6000; ++n) {
    const auto kind = static_cast<std::uint64_t>(n % 4);
    const SolidShape hull = test::random_hull(&random), other = partner(kind, &random);
    const bool hull_first = random.below(2) == 0;
    const Transform at = make_transform(test::random_rotation(&random), {});
    const Transform pose = make_transform(test::random_rotation(&random),
                                          random.uniform_in_box({-1, -1, -1}, {1, 1, 1}));
    RoundedPoints a(hull, at);
    const RoundedPoints b(other, pose);
    const double radius = a.radius + b.radius, core = core_gap(a, b), gap = core - radius;
    const detail::PairManifold found = hull_first ? contact_between(hull, at, other, pose)
                                                  : contact_between(other, pose, hull, at);
    const double tolerance = 2e-5;
    if (gap > tolerance) {
      ASSERT_EQ(found.touch_count, 0u) << n << ", gap " << gap;
      continue;
    }
    if (core > 0 && gap > -tolerance) continue;
    if (core == 0 && found.touch_count == 0) {  // the depth may be less than rounding
      ++missed;
      continue;
    }
    ASSERT_GT(found.touch_count, 0u) << n << ", gap " << gap;
    ++touching[kind];
    const Real distance = deepest(found);
    ASSERT_NEAR(static_cast<double>(length(found.normal)), 1, 1e-5);
    if (core > 1e-4) {
      ASSERT_NEAR(static_cast<double>(distance), gap, 0.011 * radius + 1e-4) << n;
    }
    a.move(found.normal * (hull_first ? -distance : distance));
    // Without overlap after the motion; an edge may have up to 2 % less depth than the face that is
    // preferred, and a capsule up to a hundredth of its radius.
    const double left = core_gap(a, b) - radius;
    ASSERT_GT(left, -0.021 * static_cast<double>(-distance) - 0.011 * radius - 1e-4)
        << n << ", kind " << kind;
    deep[kind] += core < 1e-9 ? 1 : 0;
  }
  EXPECT_LE(missed, 2);
  for (int kind = 0; kind < 4; ++kind) {
    EXPECT_GT(touching[kind], 100) << kind;
    if (kind != 0) {
      EXPECT_GT(deep[kind], 30) << kind;
    }
  }
}

/// Each point is in the middle of the overlap: within half the depth of both solids.
TEST(HullContact, PointsAreInTheOverlap) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  std::uint64_t points = 0;
  for (int n = 0; n < 3000; ++n) {
    const SolidShape a = test::random_hull(&random);
    const SolidShape b = random.below(2) == 0 ? partner(1, &random) : partner(3, &random);
    const Transform at = make_transform(test::random_rotation(&random), {});
    const Transform pose = make_transform(test::random_rotation(&random),
                                          random.uniform_in_box({-1, -1, -1}, {1, 1, 1}));
    const detail::PairManifold found = contact_between(a, at, b, pose);
    const RoundedPoints of_a(a, at), of_b(b, pose);
    for (std::uint32_t k = 0; k < found.touch_count; ++k) {
      RoundedPoints point(Sphere{1}, {{}, found.touches[k].point});
      const double depth = -static_cast<double>(found.touches[k].distance);
      EXPECT_LT(core_gap(point, of_a), 0.52 * depth + 1e-4) << n;
      EXPECT_LT(core_gap(point, of_b), 0.52 * depth + 1e-4) << n;
      ++points;
    }
  }
  EXPECT_GT(points, 100u);
}

std::vector<Vec3> corners_of(const Vec3& half) {
  std::vector<Vec3> corners;
  for (int i = 0; i < 8; ++i) {
    corners.push_back({(i & 1) != 0 ? half.x : -half.x, (i & 2) != 0 ? half.y : -half.y,
                       (i & 4) != 0 ? half.z : -half.z});
  }
  return corners;
}

/// As FacesInExactContactHavePointsOnBothBoxes of boxes.
TEST(HullContact, FacesInExactContactHavePointsOnBothHulls) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int touching = 0;
  for (int n = 0; n < 4000; ++n) {
    Vec3 half[2];
    SolidShape shapes[2];
    for (int k = 0; k < 2; ++k) {
      half[k] = random.uniform_in_box({0.05_r, 0.05_r, 0.05_r}, {2, 2, 2});
      if (k == 1 && random.below(2) == 0) {
        shapes[k] = Box{half[k]};
      } else {
        shapes[k] = Hull(corners_of(half[k]));
      }
    }
    Transform poses[2] = {make_transform(test::random_rotation(&random), {})};
    poses[1] = poses[0] * test::touching_pose(half[0], half[1], &random);
    if (random.below(2) == 0) {
      std::swap(half[0], half[1]), std::swap(shapes[0], shapes[1]), std::swap(poses[0], poses[1]);
    }
    const detail::PairManifold found = contact_between(shapes[0], poses[0], shapes[1], poses[1]);
    for (std::uint32_t k = 0; k < found.touch_count; ++k) {
      ++touching;
      for (int i = 0; i < 2; ++i) {
        const Vec3 local = inverse_transform_point(poses[i], found.touches[k].point);
        for (int axis = 0; axis < 3; ++axis) {
          ASSERT_LE(absolute(local[axis]), half[i][axis] + 1e-4_r) << n << ", shape " << i;
        }
      }
    }
  }
  EXPECT_GT(touching, 1000);
}

/// A hull with the vertices of a box has the contacts of the box, to rounding.
TEST(HullContact, AHullOfABoxHasTheContactsOfTheBox) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int touching = 0;
  for (int n = 0; n < 3000; ++n) {
    const Box box{random.uniform_in_box({0.2_r, 0.2_r, 0.2_r}, {0.8_r, 0.8_r, 0.8_r})};
    const Hull hull(corners_of(box.half_extents));
    ASSERT_EQ(hull.faces().size(), 6u);
    const SolidShape other = partner(random.below(3), &random);
    const Transform at = make_transform(test::random_rotation(&random), {});
    const Transform pose = make_transform(test::random_rotation(&random),
                                          random.uniform_in_box({-1, -1, -1}, {1, 1, 1}));
    const detail::PairManifold found = contact_between(hull, at, other, pose),
                               expected = contact_between(box, at, other, pose);
    const Real depth = deepest(expected);
    if (depth > -1e-4_r && depth < 0) continue;
    ASSERT_EQ(found.touch_count > 0, expected.touch_count > 0) << n;
    if (expected.touch_count == 0) continue;
    ++touching;
    // Preferred axes may differ by 2 % of the depth.
    ASSERT_NEAR(deepest(found), depth, 0.021_r * -depth + 1e-4_r) << n;
  }
  EXPECT_GT(touching, 300);
}

/// The face that is most opposite to the ground need not have the lowest vertex.
TEST(HullContact, ALongHullTouchesTheGroundWithItsLowestVertex) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  const TriangleMesh triangle({{-60, 0, -60}, {0, 0, 90}, {60, 0, -60}}, {{0, 1, 2}});
  const Box floor{{20, 1, 20}};
  const detail::MeshView ground = detail::view_of(triangle);
  for (int n = 0; n < 2000; ++n) {
    std::vector<Vec3> points;
    for (std::uint64_t left = 5 + random.below(30); left > 0; --left) {
      points.push_back(component_product(test::random_direction(&random), {0.3_r, 0.3_r, 1.2_r}));
    }
    const Hull hull = centred(Hull(points));
    Transform pose = make_transform(test::random_rotation(&random), {});
    Real lowest = 0;
    for (const Vec3& v : hull.vertices()) lowest = std::min(lowest, (pose.basis * v).y);
    pose.origin.y = -lowest - 0.005_r;
    detail::PairManifold found;
    find_contact_with_triangle(detail::instance(hull, pose), ground, 0, {}, {}, &found);
    ASSERT_GT(found.touch_count, 0u) << n;
    ASSERT_NEAR(deepest(found), -0.005_r, 1e-4_r) << n;
    const detail::PairManifold on_box = contact_between(hull, pose, floor, {{}, {0, -1, 0}});
    ASSERT_GT(on_box.touch_count, 0u) << n;
    ASSERT_NEAR(deepest(on_box), -0.005_r, 2e-4_r) << n;
  }
}

TEST(HullContact, OnAHalfSpaceTheLowestVerticesTouch) {
  Random random(7);
  for (int n = 0; n < 300; ++n) {
    const Hull hull = test::random_hull(&random);
    const Transform pose = make_transform(test::random_rotation(&random), {0, 0.2_r, 0});
    detail::PairManifold found;
    find_contact(detail::instance(hull, pose), HalfSpace{}, {}, &found);
    Real lowest = 1;
    std::uint32_t below = 0;
    for (const Vec3& v : hull.vertices()) {
      const Real height = transform_point(pose, v).y;
      lowest = std::min(lowest, height);
      below += height <= 0 ? 1 : 0;
    }
    ASSERT_EQ(found.touch_count > 0, below > 0) << n;
    ASSERT_LE(found.touch_count, std::min(below, 8u)) << n;
    if (below > 0) {
      ASSERT_EQ(deepest(found), lowest) << n;
    }
  }
}

TEST(HullContact, RaysEnterAtTheFirstFace) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int hits = 0;
  for (int n = 0; n < 4000; ++n) {
    const Hull hull = test::random_hull(&random);
    const Transform pose = make_transform(test::random_rotation(&random),
                                          random.uniform_in_box({-1, -1, -1}, {1, 1, 1}));
    const Vec3 from = random.uniform_in_box({-3, -3, -3}, {3, 3, 3});
    const Vec3 to = random.uniform_in_box({-1, -1, -1}, {1, 1, 1});
    const Vec3 direction = normalized(to - from);
    const detail::RayEntry entry = detail::enter(from, direction, hull, pose);
    const RoundedPoints solid(hull, pose);
    const auto gap_at = [&](Real t) {
      return core_gap(RoundedPoints(Sphere{1}, {{}, add_scaled(from, direction, t)}), solid);
    };
    if (!entry.hit) {
      for (Real t = 0; t < 8; t += 0.05_r) ASSERT_GT(gap_at(t), 0) << n;
      continue;
    }
    ++hits;
    ASSERT_LT(gap_at(entry.distance), 1e-5) << n;
    for (Real t = 0; t < entry.distance - 1e-3_r; t += 0.05_r) ASSERT_GT(gap_at(t), 0) << n;
    ASSERT_LT(dot(entry.normal, direction), 0) << n;
  }
  EXPECT_GT(hits, 150);
}

}  // namespace
}  // namespace jfpx
