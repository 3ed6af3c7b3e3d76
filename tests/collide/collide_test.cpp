/// Tests of spheres against half-spaces and boxes, with hand-computed values and properties.
#include <jfpx/collide.hpp>

#include "tests/world/support.hpp"

#include <gtest/gtest.h>

namespace jfpx {
namespace {

using test::operator""_r;

constexpr Real kTolerance = 32 * kEpsilon;

void expect_near(const Vec3& actual, const Vec3& expected, Real tolerance = kTolerance) {
  EXPECT_NEAR(actual.x, expected.x, tolerance);
  EXPECT_NEAR(actual.y, expected.y, tolerance);
  EXPECT_NEAR(actual.z, expected.z, tolerance);
}

TEST(SphereHalfSpace, ContactIsInTheMiddleOfTheOverlap) {
  // The lowest point of the sphere is at y = 1.5 and the surface at y = 2, so the middle is at
  // 1.75.
  const Touch touch = collide(SphereInstance{{3, 2.5, 4}, 1}, HalfSpace{{0, 1, 0}, 2});
  ASSERT_TRUE(touch.touching);
  EXPECT_EQ(touch.normal, (Vec3{0, 1, 0}));
  EXPECT_EQ(touch.distance, -0.5_r);
  EXPECT_EQ(touch.point, (Vec3{3, 1.75, 4}));
}

TEST(SphereHalfSpace, TouchingIsAContactAndAGapIsNone) {
  const HalfSpace ground;
  EXPECT_TRUE(collide(SphereInstance{{0, 1, 0}, 1}, ground).touching);
  EXPECT_FALSE(collide(SphereInstance{{0, 1 + 2 * kEpsilon, 0}, 1}, ground).touching);
}

TEST(SphereHalfSpace, ASphereInsideIsPushedOut) {
  const Touch touch = collide(SphereInstance{{0, -5, 0}, 1}, HalfSpace{});
  EXPECT_EQ(touch.distance, -6);
  EXPECT_EQ(touch.point, (Vec3{0, -3, 0}));  // between 0 and -6
}

TEST(SphereBox, FaceEdgeAndCornerGiveTheClosestPoint) {
  const Box box{{1, 2, 3}};
  const Transform pose{Mat3{}, {10, 0, 0}};
  Touch touch = collide(SphereInstance{{11.5, 1, 1}, 1}, box, pose);
  expect_near(touch.normal, {1, 0, 0});
  EXPECT_NEAR(touch.distance, -0.5, kTolerance);
  expect_near(touch.point, {10.75, 1, 1});

  touch = collide(SphereInstance{{11.3_r, 2.4_r, 0}, 1}, box, pose);  // 0.3-0.4-0.5 triangle
  expect_near(touch.normal, {0.6_r, 0.8_r, 0}, 16 * kTolerance);
  EXPECT_NEAR(touch.distance, -0.5, 16 * kTolerance);

  // From the corner (11,2,3) by (0.2,0.4,0.4), of length 0.6.
  touch = collide(SphereInstance{{11.2_r, 2.4_r, 3.4_r}, 1}, box, pose);
  expect_near(touch.normal, {Real(1) / 3, Real(2) / 3, Real(2) / 3}, 16 * kTolerance);
  EXPECT_NEAR(touch.distance, -0.4, 16 * kTolerance);
  EXPECT_FALSE(collide(SphereInstance{{11.2_r, 2.4_r, 3.4_r}, 0.59_r}, box, pose).touching);
}

TEST(SphereBox, FollowsTheRotationOfTheBox) {
  const Real half = square_root(0.5_r);
  const Transform rotated = make_transform(Quat{half, 0, 0, half}, {});  // x to y, y to -x
  const Touch touch = collide(SphereInstance{{0, 2.5, 0}, 1}, Box{{2, 1, 1}}, rotated);
  ASSERT_TRUE(touch.touching);
  expect_near(touch.normal, {0, 1, 0});
  EXPECT_NEAR(touch.distance, -0.5, 4 * kTolerance);
}

TEST(Erratum, E09_a_centre_inside_a_box_leaves_by_the_nearest_face) {
  const Box box{{1, 2, 3}};
  const Transform pose;
  struct Case {
    Vec3 centre, normal;
    Real depth;
  };
  const Case cases[] = {
      {{0.75_r, 0, 0}, {1, 0, 0}, 0.25_r}, {{-0.75_r, 0, 0}, {-1, 0, 0}, 0.25_r},
      {{0, 1.75_r, 0}, {0, 1, 0}, 0.25_r}, {{0, -1.75_r, 0}, {0, -1, 0}, 0.25_r},
      {{0, 0, 2.75_r}, {0, 0, 1}, 0.25_r}, {{0, 0, -2.75_r}, {0, 0, -1}, 0.25_r},
      {{0, 0, 0}, {1, 0, 0}, 1},           {{1, 0, 0}, {1, 0, 0}, 0},
      {{1, 2, 3}, {1, 0, 0}, 0},
  };
  for (const Case& c : cases) {
    const Touch touch = collide(SphereInstance{c.centre, 0.5_r}, box, pose);
    ASSERT_TRUE(touch.touching);
    EXPECT_EQ(touch.normal, c.normal);
    EXPECT_EQ(touch.distance, -(0.5_r + c.depth));
    // Half-way between the deepest point of the sphere and the face.
    expect_near(touch.point, c.centre + c.normal * ((c.depth - 0.5_r) / 2));
  }
}

TEST(SphereBox, MovingByTheContactEndsTheOverlap) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int touches = 0;
  for (int i = 0; i < 20000; ++i) {
    const Box box{random.uniform_in_box({0.01_r, 0.1_r, 1}, {0.1_r, 1, 10})};
    const Vec3 v = random.uniform_in_box({-2, -2, -2}, {2, 2, 2});
    const Transform pose =
        make_transform(normalized(Quat{random.uniform(-1, 1), v.x, v.y, v.z}), v * Real(3));
    const SphereInstance sphere{
        transform_point(pose, random.uniform_in_box({-1, -2, -12}, {1, 2, 12})),
        random.uniform(0.01_r, 2)};
    const Touch touch = collide(sphere, box, pose);
    if (!touch.touching) continue;
    ++touches;
    const Real noise = 500 * kEpsilon;
    ASSERT_NEAR(length(touch.normal), 1, noise);
    const SphereInstance out{sphere.centre - touch.normal * (touch.distance - noise),
                             sphere.radius};
    ASSERT_FALSE(collide(out, box, pose).touching);
    const SphereInstance in{sphere.centre - touch.normal * (touch.distance + noise), sphere.radius};
    ASSERT_TRUE(collide(in, box, pose).touching);
  }
  EXPECT_GT(touches, 1000);
}

TEST(SphereBox, NonFiniteSpheresHaveNoContact) {
  const Real nan = std::numeric_limits<Real>::quiet_NaN();
  EXPECT_FALSE(collide(SphereInstance{{nan, 0, 0}, 1}, HalfSpace{}).touching);
  EXPECT_FALSE(
      collide(SphereInstance{{0, 0, std::numeric_limits<Real>::infinity()}, 1}, Box{}, Transform{})
          .touching);
}

}  // namespace
}  // namespace jfpx
