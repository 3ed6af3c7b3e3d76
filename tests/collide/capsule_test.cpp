/// Tests of the capsule: contacts against a convex distance in double, mass and submerged volume
/// against sums over small cells.
#include <jfpx/collide.hpp>

#include "src/collide/shapes.hpp"
#include "tests/collide/convex_distance.hpp"
#include "tests/world/random_bodies.hpp"

#include <gtest/gtest.h>

namespace jfpx {
namespace {

using test::operator""_r;
using test::kEps;
using test::Point;

/// A solid as the convex hull of points with a radius around it.
struct RoundedHull {
  std::vector<Point> points;
  double radius = 0;

  RoundedHull(const SolidShape& solid, const Transform& pose) {
    std::visit([&](const auto& s) { add(detail::to_solid(s), pose); }, solid);
  }
  void add(const detail::Solid& solid, const Transform& pose) {
    radius = static_cast<double>(solid.radius);
    for (int n = 0; n < 8; ++n) {
      Point p{};
      for (int i = 0; i < 3; ++i) {
        auto x = static_cast<double>(pose.origin[i]);
        for (int k = 0; k < 3; ++k) {
          const auto h = static_cast<double>(solid.half_extents[k]);
          x += (n >> k & 1 ? h : -h) * static_cast<double>(pose.basis(i, k));
        }
        p[static_cast<std::size_t>(i)] = x;
      }
      if (std::ranges::find(points, p) == points.end()) points.push_back(p);
    }
  }
  void move(const Vec3& direction, double by) {
    for (Point& p : points) {
      for (std::size_t i = 0; i < 3; ++i) {
        p[i] += static_cast<double>(direction[static_cast<int>(i)]) * by;
      }
    }
  }
};

/// Distance of the hulls without their radii; 0 if these overlap.
double core_gap(const RoundedHull& a, const RoundedHull& b) {
  return test::length(test::separation(a.points, b.points));
}

SolidShape random_solid(Random* random, std::uint64_t kind) {
  if (kind == 0) return Sphere{random->uniform(0.1_r, 1)};
  if (kind == 1) return Box{random->uniform_in_box({0.1_r, 0.1_r, 0.1_r}, {1, 1, 1})};
  return Capsule{random->uniform(0.05_r, 0.6_r), random->uniform(0.05_r, 1.5_r)};
}

/// A random rotation, or one of the capsule's axis near an axis of the world.
Quat random_turn(Random* random) {
  if (random->below(2) == 0) return test::random_rotation(random);
  const Quat quarters[] = {{}, {1, 1, 0, 0}, {1, 0, 0, 1}};
  const Quat q = normalized(quarters[random->below(3)]);
  const Real angle = random->below(3) == 0 ? Real(0) : random->uniform(0, 0.08_r);
  return normalized(add_scaled(q, test::random_direction(random), angle));
}

struct Pair {
  SolidShape a, b;
  Transform pose_a, pose_b;
};
Pair random_pair(Random* random) {
  const SolidShape a = random_solid(random, 2), b = random_solid(random, random->below(3));
  const Vec3 home = random->uniform_in_box({-5, -5, -5}, {5, 5, 5});
  const Vec3 range{1.3_r, 1.3_r, 1.3_r};
  return {a, b, make_transform(random_turn(random), home + random->uniform_in_box(-range, range)),
          make_transform(random_turn(random), home)};
}

TEST(Capsule, ContactsHaveTheDepthOfTheOracle) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int clear = 0, shallow = 0, deep = 0, two_points = 0;
  for (int n = 0; n < 100000; ++n) {
    const Pair pair = random_pair(&random);
    const Manifold manifold = collide(pair.a, pair.pose_a, pair.b, pair.pose_b);
    RoundedHull a(pair.a, pair.pose_a);
    const RoundedHull b(pair.b, pair.pose_b);
    const double gap = core_gap(a, b), radii = a.radius + b.radius;
    const double noise = 300 * kEps * 10;
    if (manifold.count == 0) {
      ++clear;
      ASSERT_GE(gap, radii - noise) << n;
      continue;
    }
    ASSERT_LE(gap, radii + noise) << n;
    ASSERT_NEAR(length(manifold.normal), 1, 64 * kEps) << n;
    two_points += manifold.count == 2 ? 1 : 0;
    const auto depth = -static_cast<double>(manifold.distance);
    // The normal may be that of a face, or of two axes, to within 4 degrees, and the points of two
    // axes at the ends of their common part.
    const bool is_exact = std::holds_alternative<Sphere>(pair.b);
    const double slack = is_exact ? noise : 0.003 * (radii + 4) + 0.01 * radii;
    if (gap > noise) {
      ++shallow;
      ASSERT_NEAR(depth, radii - gap, slack) << n;
    } else {
      ++deep;
      ASSERT_GE(depth, radii - noise) << n;
    }
    // Translated along the normal by the depth, the solids only touch.
    a.move(manifold.normal, depth);
    const double after = core_gap(a, b);
    ASSERT_GE(after, radii - std::max(slack, 0.05 * depth)) << n;
    if (gap > noise) {
      ASSERT_NEAR(after, radii, std::max(slack + 0.02 * depth, 10 * noise)) << n;
    }
    // Points are in the middle of the overlap, which may be outside of a solid that is contained.
    for (int i = 0; i < manifold.count && depth < 0.1; ++i) {
      Point p{};
      for (int k = 0; k < 3; ++k) {
        p[static_cast<std::size_t>(k)] = static_cast<double>(manifold.points[i].point[k]);
      }
      const std::vector<Point> at{p};
      const double to_b = test::length(test::separation(at, b.points));
      ASSERT_LE(to_b, b.radius + slack) << n << ' ' << i;
    }
  }
  EXPECT_GT(clear, 1000);
  EXPECT_GT(shallow, 10000);
  EXPECT_GT(deep, 1000);
  EXPECT_GT(two_points, 1000);
}

TEST(Capsule, TheOrderOfTwoSolidsHasNoEffect) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int touches = 0;
  for (int n = 0; n < 20000; ++n) {
    const Pair pair = random_pair(&random);
    const Manifold forth = collide(pair.a, pair.pose_a, pair.b, pair.pose_b);
    const Manifold back = collide(pair.b, pair.pose_b, pair.a, pair.pose_a);
    if (std::holds_alternative<Capsule>(pair.b)) {  // the axis of the first capsule has the points
      ASSERT_NEAR(forth.distance, back.distance, 0.01_r) << n;
      continue;
    }
    ASSERT_EQ(forth.count, back.count) << n;
    touches += forth.count;
    if (forth.count == 0) continue;
    ASSERT_EQ(forth.normal, -back.normal) << n;
    for (int i = 0; i < forth.count; ++i) ASSERT_EQ(forth.points[i], back.points[i]) << n;
  }
  EXPECT_GT(touches, 5000);
}

/// Shapes that meet have a contact, and the gap along its normal closes at the latest when they
/// meet.
TEST(Capsule, ContactsOfAStepAreThoseThatMeetInIt) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int meet = 0, pass = 0;
  for (int n = 0; n < 4000; ++n) {
    const Pair pair = random_pair(&random);
    const Vec3 motion = random.uniform_in_box({-3, -3, -3}, {3, 3, 3});
    detail::PairManifold contact;
    const auto test = [&](const auto& first, const auto& second) {
      detail::find_contact_of_any(detail::instance(first, pair.pose_a),
                                  detail::instance(second, pair.pose_b),
                                  {motion, 0, kMaxReal, {}, {}}, &contact);
    };
    std::visit(test, pair.a, pair.b);
    RoundedHull a(pair.a, pair.pose_a);
    const RoundedHull b(pair.b, pair.pose_b);
    constexpr int kSteps = 200;
    double deepest = core_gap(a, b) - a.radius - b.radius;
    for (int i = 0; i < kSteps; ++i) {
      a.move(motion, 1.0 / kSteps);
      deepest = std::min(deepest, core_gap(a, b) - a.radius - b.radius);
    }
    if (deepest > 0.05) {
      ++pass;
      // 16 steps of an advancement may end before a close passage.
      if (deepest > 0.5) {
        ASSERT_EQ(contact.point_count, 0u) << n;
      }
    } else if (deepest < -0.01) {
      ++meet;
      ASSERT_GT(contact.point_count, 0u) << n;
      const Real opening = dot(motion, contact.normal);
      Real least = kMaxReal;
      for (std::uint32_t i = 0; i < contact.point_count; ++i) {
        least = std::min(least, contact.points[i].distance);
      }
      ASSERT_LE(least + std::min(opening, Real(0)), 0.02_r) << n;
    }
  }
  EXPECT_GT(meet, 500);
  EXPECT_GT(pass, 300);
}

TEST(Capsule, LiesOnBothEndsOfItsAxis) {
  const Capsule capsule{0.25_r, 1};
  const Transform lying = make_transform(normalized(Quat{1, 1, 0, 0}), {0, 0.24_r, 0});
  const Manifold on_box = collide(capsule, lying, Box{{3, 1, 3}}, {{}, {0, -1, 0}});
  ASSERT_EQ(on_box.count, 2);
  EXPECT_EQ(on_box.normal, (Vec3{0, 1, 0}));
  EXPECT_NEAR(on_box.points[0].point.z, -1, 1e-5);
  EXPECT_NEAR(on_box.points[1].point.z, 1, 1e-5);
  for (int i = 0; i < 2; ++i) EXPECT_NEAR(on_box.points[i].distance, -0.01, 1e-5);
  const Manifold on_floor = collide(capsule, lying, HalfSpace{});
  EXPECT_EQ(on_floor.count, 2);
  // Beside the edge of the box there is nothing below the end.
  const Manifold over_edge = collide(capsule, lying, Box{{3, 1, 3}}, {{}, {0, -1, 2.5_r}});
  ASSERT_EQ(over_edge.count, 2);
  EXPECT_NEAR(over_edge.points[0].point.z, -0.5, 1e-5);
  const Transform beside = make_transform(normalized(Quat{1, 1, 0, 0}), {0.48_r, 0, 0.5_r});
  const Manifold parallel = collide(capsule, {lying.basis, {}}, capsule, beside);
  ASSERT_EQ(parallel.count, 2);
  EXPECT_NEAR(parallel.points[0].point.z, -0.5, 1e-5);
  EXPECT_NEAR(parallel.points[1].point.z, 1, 1e-5);
}

TEST(Capsule, OnAPointOfItsAxisHasAUnitNormal) {
  const Capsule capsule{0.5_r, 1};
  const Transform turned = make_transform(normalized(Quat{1, 0.3_r, 0.2_r, 0.1_r}), {1, 2, 3});
  for (const SolidShape& other : {SolidShape(Sphere{0.3_r}), SolidShape(Capsule{0.2_r, 2})}) {
    const Manifold manifold = collide(capsule, turned, other, turned);
    ASSERT_GE(manifold.count, 1);
    EXPECT_NEAR(length(manifold.normal), 1, 1e-5);
    EXPECT_LT(manifold.distance, -0.6_r);
  }
}

/// Volume, centre and moments from small cells.
TEST(Capsule, MassAndSubmergedVolumeAgreeWithSampling) {
  const Capsule capsule{0.4_r, 0.7_r};
  constexpr int kSide = 120;
  const Mat3 basis = to_matrix(normalized(Quat{2, 0.3_r, -0.5_r, 0.7_r}));
  std::vector<Vec3> cells;
  const Vec3 half{capsule.radius, capsule.radius + capsule.half_height, capsule.radius};
  const auto at = [](int i) { return (static_cast<Real>(i) + 0.5_r) * 2 / kSide - 1; };
  for (int n = 0; n < kSide * kSide * kSide; ++n) {
    const Vec3 p =
        component_product(half, {at(n % kSide), at(n / kSide % kSide), at(n / kSide / kSide)});
    const Real y = std::max(absolute(p.y) - capsule.half_height, Real(0));
    if (p.x * p.x + y * y + p.z * p.z <= capsule.radius * capsule.radius) cells.push_back(p);
  }
  const double cell = 8.0 * half.x * half.y * half.z / (kSide * kSide * kSide);
  const double volume = cell * static_cast<double>(cells.size());
  EXPECT_NEAR(detail::volume(capsule), volume, 0.003 * volume);
  double xx = 0, yy = 0;
  for (const Vec3& p : cells) {
    xx += p.y * p.y + p.z * p.z;
    yy += p.x * p.x + p.z * p.z;
  }
  const Vec3 moments = detail::moments_of_inertia(capsule, 3);
  EXPECT_NEAR(moments.x, 3 * xx / static_cast<double>(cells.size()), 0.005 * moments.x);
  EXPECT_NEAR(moments.y, 3 * yy / static_cast<double>(cells.size()), 0.005 * moments.y);
  EXPECT_EQ(moments.z, moments.x);
  for (const Vec3& up : {Vec3{0, 1, 0}, Vec3{1, 0, 0}, Vec3{0.3_r, 0.8_r, -0.5_r}}) {
    const Vec3 normal = normalized(up);
    for (const Real offset : {-2.0_r, -0.8_r, -0.3_r, 0.0_r, 0.1_r, 0.5_r, 2.0_r}) {
      const detail::Submerged below = detail::submerged(capsule, basis, {normal, offset});
      double count = 0;
      Vec3 sum;
      for (const Vec3& p : cells) {
        const Vec3 world = basis * p;
        if (dot(normal, world) > offset) continue;
        ++count;
        sum += world;
      }
      EXPECT_NEAR(below.volume, count * cell, 0.01 * volume) << offset;
      for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(below.moment[k], sum[k] * cell, 0.01 * volume) << offset;
      }
    }
  }
}

}  // namespace
}  // namespace jfpx
