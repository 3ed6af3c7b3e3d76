/// Tests of the closest points of two solids, against their farthest points in double: points
/// inside both solids bound the distance from above, and the separation along the normal from
/// below.
#include <jfpx/collide.hpp>

#include "tests/collide/random_solids.hpp"
#include "tests/collide/support_oracle.hpp"
#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

constexpr double kGapTolerance = sizeof(Real) == 4 ? 1e-6 : 1e-8;

double radius_about_origin(const SolidShape& shape) {
  return std::visit([](const auto& s) { return static_cast<double>(detail::bounding_radius(s)); },
                    shape);
}

struct SolidPair {
  SolidShape a, b;
  Transform pose_a, pose_b;

  ClosestPoints closest() const { return closest_points(a, pose_a, b, pose_b); }
  /// [m], scale of the errors: sizes, distance, and coordinates of the results.
  double size() const {
    const Vec3 between = pose_a.origin - pose_b.origin;
    return radius_about_origin(a) + radius_about_origin(b) + length(to_point(between)) +
           length(to_point(pose_a.origin)) + length(to_point(pose_b.origin));
  }
};

SolidShape thin_solid(Random* random) {
  const Real small = 0.001_r * random->uniform(0.5_r, 2), large = random->uniform(0.5_r, 1);
  switch (random->below(5)) {
    case 0:
      return Box{{small, large, random->below(2) == 0 ? small : large}};
    case 1:
      return Capsule{small, large};
    case 2:
      return random->below(2) == 0 ? Cylinder{small, large} : Cylinder{large, small};
    case 3:
      return random->below(2) == 0 ? Cone{small, large} : Cone{large, small};
    default:
      return random_hull(random).scaled({small, large, large});
  }
}

/// @param spread [m], of the positions
SolidPair random_pair(Random* random, Real spread) {
  const auto solid = [&] {
    return random->below(4) == 0 ? thin_solid(random) : partner(random->below(kPartners), random);
  };
  const auto pose = [&] {
    return make_transform(random_tilt(random),
                          random->uniform_in_box({-1, -1, -1}, {1, 1, 1}) * spread);
  };
  return {solid(), solid(), pose(), pose()};
}

void expect_inside(const SupportSolid& solid, const Vec3& point, double tolerance, Random* random) {
  for (int i = 0; i < 60; ++i) {
    const Point d = to_point(random_direction(random));
    EXPECT_LE(dot(d, to_point(point)), solid.reach(d) * (1 + 1e-15) + tolerance);
  }
}

void expect_closest(const SolidPair& pair, const ClosestPoints& found, Random* random) {
  const double tolerance = kGapTolerance * pair.size();
  const SupportSolid a(pair.a, pair.pose_a), b(pair.b, pair.pose_b);
  const Point n = to_point(found.normal);
  const auto distance = static_cast<double>(found.distance);
  EXPECT_NEAR(length(n), 1, 1e-6);
  const Point between = to_point(found.point_a - found.point_b);
  EXPECT_NEAR(length(between - scaled(n, distance)), 0, tolerance);
  EXPECT_GE(separation_along(a, b, n), distance - tolerance);
  // The closest points of curved shapes that nearly touch may be beside each other.
  const bool is_close = distance < pair.size() * 1e-6;
  const double beside = is_close ? 1e-3 * pair.size() : tolerance;
  expect_inside(a, found.point_a, beside, random);
  expect_inside(b, found.point_b, beside, random);
}

/// Moving a by -distance along the normal ends the overlap.
void expect_depth(const SolidPair& pair, const ClosestPoints& found) {
  const double tolerance = 2 * kGapTolerance * pair.size();
  const SupportSolid a(pair.a, pair.pose_a), b(pair.b, pair.pose_b);
  const auto distance = static_cast<double>(found.distance);
  EXPECT_NEAR(separation_along(a, b, to_point(found.normal)), distance, tolerance);
  const Vec3 between = found.point_a - found.point_b - found.normal * found.distance;
  EXPECT_NEAR(length(to_point(between)), 0, tolerance);
}

/// Whether another axis has a much smaller depth.
bool is_deeper_than_needed(const SolidPair& pair, const ClosestPoints& found, Random* random) {
  const SupportSolid a(pair.a, pair.pose_a), b(pair.b, pair.pose_b);
  const double best = largest_separation(a, b, random);
  return static_cast<double>(found.distance) < 1.1 * best - 1e-4;
}

TEST(ClosestPoints, OfSolidsAreInBothAndAsFarAsTheNormalSeparatesThem) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  int apart = 0, touching = 0, too_deep = 0;
  for (int run = 0; run < 20000 && !testing::Test::HasFailure(); ++run) {
    const Real spreads[] = {1, 3, 100, 10000};
    const SolidPair pair = random_pair(&random, spreads[random.below(4)]);
    SCOPED_TRACE(testing::Message() << run << ": " << pair.a.index() << ", " << pair.b.index());
    const ClosestPoints found = pair.closest();
    const ClosestPoints swapped = closest_points(pair.b, pair.pose_b, pair.a, pair.pose_a);
    if (found.distance > 0) {
      ++apart;
      expect_closest(pair, found, &random);
      EXPECT_NEAR(swapped.distance, found.distance, 2 * kGapTolerance * pair.size());
    } else {
      ++touching;
      expect_depth(pair, found);
      expect_depth({pair.b, pair.a, pair.pose_b, pair.pose_a}, swapped);
      if (is_deeper_than_needed(pair, found, &random)) ++too_deep;
    }
  }
  EXPECT_GT(apart, 5000);
  EXPECT_GT(touching, 300);
  EXPECT_LT(too_deep, touching / 20);
}

TEST(ClosestPoints, OfSolidsThatNearlyTouchAreAsAccurate) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  int apart = 0;
  for (int run = 0; run < 10000 && !testing::Test::HasFailure(); ++run) {
    SolidPair pair = random_pair(&random, 2);
    SCOPED_TRACE(testing::Message() << run << ": " << pair.a.index() << ", " << pair.b.index());
    const ClosestPoints far_apart = pair.closest();
    if (!(far_apart.distance > 0)) continue;
    const Real gap = std::pow(Real(10), random.uniform(-7, -1));
    pair.pose_a.origin += far_apart.normal * (gap - far_apart.distance);
    const ClosestPoints found = pair.closest();
    EXPECT_NEAR(found.distance, gap, 4 * kGapTolerance * pair.size());
    ++apart;
    expect_closest(pair, found, &random);
  }
  EXPECT_GT(apart, 3000);
}

TEST(ClosestPoints, OfAPointAreThoseOfASphereWithoutARadius) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  int inside = 0;
  for (int run = 0; run < 3000 && !testing::Test::HasFailure(); ++run) {
    SolidPair pair = random_pair(&random, 0.5_r);
    pair.a = Sphere{0};
    SCOPED_TRACE(testing::Message() << run << ": " << pair.b.index());
    const ClosestPoints found = pair.closest();
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(found.point_a[i], pair.pose_a.origin[i], 1e-5);
    }
    if (found.distance > 0) {
      expect_closest(pair, found, &random);
      continue;
    }
    ++inside;
    const SupportSolid a(pair.a, pair.pose_a), b(pair.b, pair.pose_b);
    const auto distance = static_cast<double>(found.distance);
    EXPECT_NEAR(separation_along(a, b, to_point(found.normal)), distance, 1e-5);
    EXPECT_GE(distance, largest_separation(a, b, &random) - 1e-5);
  }
  EXPECT_GT(inside, 300);
}

TEST(ClosestPoints, OfAHalfSpaceAreTheLowestPointAndItsProjection) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  int apart = 0;
  for (int run = 0; run < 3000; ++run) {
    SCOPED_TRACE(run);
    const SolidPair pair = random_pair(&random, 3);
    const HalfSpace wall{random_direction(&random), random.uniform(-2, 2)};
    const ClosestPoints found = closest_points(pair.a, pair.pose_a, wall);
    const Point n = to_point(wall.normal);
    const double lowest = -SupportSolid(pair.a, pair.pose_a).reach(scaled(n, -1));
    EXPECT_EQ(found.normal, wall.normal);
    EXPECT_NEAR(static_cast<double>(found.distance), lowest - static_cast<double>(wall.offset),
                kGapTolerance * 10);
    EXPECT_NEAR(dot(n, to_point(found.point_a)), lowest, kGapTolerance * 10);
    EXPECT_NEAR(dot(n, to_point(found.point_b)), static_cast<double>(wall.offset),
                kGapTolerance * 10);
    if (found.distance > 0) ++apart;
  }
  EXPECT_GT(apart, 500);
}

TEST(ClosestPoints, OfKnownSolidsAreExact) {
  const Transform left = make_transform({}, {-3, 0, 0}), right = make_transform({}, {2, 0.25_r, 0});
  const ClosestPoints boxes = closest_points(Box{}, left, Box{}, right);
  EXPECT_EQ(boxes.distance, 4);
  EXPECT_EQ(boxes.normal, (Vec3{-1, 0, 0}));
  EXPECT_EQ(boxes.point_a.x, -2.5_r);
  EXPECT_EQ(boxes.point_b.x, 1.5_r);
  const ClosestPoints balls = closest_points(Sphere{1}, left, Sphere{1}, left);
  EXPECT_EQ(balls.distance, -2);
  EXPECT_EQ(length(balls.point_a - balls.point_b), 2);
  const ClosestPoints points = closest_points(Sphere{0}, left, Sphere{0}, left);
  EXPECT_EQ(points.distance, 0);
  EXPECT_EQ(points.point_a, left.origin);
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
