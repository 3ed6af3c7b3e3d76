/// Friction, rolling friction and spinning friction against analytic motions.
#include "tests/world/quality.hpp"

#include <gtest/gtest.h>

namespace jfpx {
namespace {

using test::operator""_r;
using test::kGravity;

/// A box or ball at rest on level ground, with gravity as on a slope.
Scene on_a_slope(BodyDef body, double degrees) {
  const double angle = degrees * 3.14159265358979 / 180;
  body.acceleration = {static_cast<Real>(kGravity * std::sin(angle)),
                       static_cast<Real>(-kGravity * std::cos(angle)), 0};
  Scene scene;
  scene.bodies = {body, test::ground()};
  return test::awake(scene);
}
Vec3 cube() { return {0.5_r, 0.5_r, 0.5_r}; }

TEST(Friction, ABoxCreepsLessThanATenthOfAMillimetrePerSecondBelowTheAngleOfFriction) {
  World world(on_a_slope(test::crate({0, 0.5_r, 0}, cube()), 20));
  test::run(&world, 1);
  const std::vector<BodyState> before = test::states_of(world);
  test::run(&world, 10);
  EXPECT_LT(test::drift(world, before), 0.001);
}

TEST(Friction, SlopesHoldOneDegreeBelowTheAngleOfFrictionAndNotOneDegreeAbove) {
  World world(test::awake(scenes::make("slope")));
  test::run(&world, 1);
  const std::vector<BodyState> before = test::states_of(world);
  test::run(&world, 4);
  const double angle = std::atan(0.5) + 3.14159265358979 / 180;
  const double expected = kGravity * (std::sin(angle) - 0.5 * std::cos(angle));
  // The bodies: a ramp, four boxes, the other ramp, four boxes.
  const std::vector<BodyState> after = world.states();
  for (std::size_t i = 1; i <= 4; ++i) {
    const BodyState &held = after[i], &slides = after[i + 5];
    EXPECT_LT(static_cast<double>(length(held.position - before[i].position)), 0.0004);
    const double gained = static_cast<double>(length(slides.velocity)) -
                          static_cast<double>(length(before[i + 5].velocity));
    EXPECT_NEAR(gained / 4, expected, 0.02 * expected);
  }
}

TEST(Friction, ASlidingBoxHasTheDecelerationOfCoulombInEveryDirection) {
  for (const double degrees : {0.0, 20.0, 45.0, 80.0}) {
    BodyDef box = test::crate({0, 0.25_r, 0}, {0.5_r, 0.25_r, 0.4_r});
    const double angle = degrees * 3.14159265358979 / 180;
    box.velocity = {static_cast<Real>(3 * std::cos(angle)), 0,
                    static_cast<Real>(3 * std::sin(angle))};
    World world(on_a_slope(box, 0));
    test::run(&world, 0.1);
    const auto before = static_cast<double>(length(world.states()[0].velocity));
    test::run(&world, 0.4);
    const auto after = static_cast<double>(length(world.states()[0].velocity));
    EXPECT_NEAR((before - after) / 0.4, 0.5 * kGravity, 0.02 * 0.5 * kGravity) << degrees;
  }
}

TEST(Friction, ABallThatSlidesBeginsToRollWithoutSlipping) {
  BodyDef ball = test::heavy_ball({0, 0.5_r, 0}, 0.5_r, 2);
  ball.velocity = {3, 0, 0};
  World world(on_a_slope(ball, 0));
  test::run(&world, 60);
  const BodyState state = world.states()[0];
  EXPECT_NEAR(static_cast<double>(state.velocity.x), 3 * 5.0 / 7, 1e-3);
  EXPECT_NEAR(static_cast<double>(state.angular_velocity.z * -0.5_r), 3 * 5.0 / 7, 1e-3);
}

TEST(Friction, RollingFrictionStopsABallWithTheAnalyticDeceleration) {
  constexpr double kLength = 0.01, kRadius = 0.5;
  BodyDef ball = test::heavy_ball({0, 0.5_r, 0}, 0.5_r, 2);
  ball.velocity = {2, 0, 0};
  ball.angular_velocity = {0, 0, -4};
  ball.rolling_friction = static_cast<Real>(kLength);
  World world(on_a_slope(ball, 0));
  test::run(&world, 2);
  // Torque balance about the point of contact: 7/5 m r^2 * (a / r) = length * m g.
  const double expected = kLength * kGravity / (1.4 * kRadius);
  EXPECT_NEAR((2 - static_cast<double>(world.states()[0].velocity.x)) / 2, expected,
              0.02 * expected);
  test::run(&world, 2 / expected);
  EXPECT_LT(test::speeds(world).largest, 1e-3);
}

TEST(Friction, SpinningFrictionStopsASpinWithTheAnalyticDeceleration) {
  constexpr double kLength = 0.01, kRadius = 0.5;
  BodyDef ball = test::heavy_ball({0, 0.5_r, 0}, 0.5_r, 2);
  ball.angular_velocity = {0, 10, 0};
  ball.spinning_friction = static_cast<Real>(kLength);
  World world(on_a_slope(ball, 0));
  test::run(&world, 2);
  const double expected = kLength * kGravity / (0.4 * kRadius * kRadius);
  const auto spin = static_cast<double>(world.states()[0].angular_velocity.y);
  EXPECT_NEAR((10 - spin) / 2, expected, 0.02 * expected);
  test::run(&world, 10);
  EXPECT_NEAR(static_cast<double>(world.states()[0].angular_velocity.y), 0, 1e-3);
}

TEST(Friction, AKinematicPlatformCarriesABox) {
  BodyDef platform = test::crate({}, {2, 0.2_r, 2}, 0);
  platform.kinematic = true;
  platform.velocity = {1, 0, 0};
  Scene scene;
  scene.bodies = {platform, test::crate({0, 0.7_r, 0}, cube())};
  World world(scene);
  test::run(&world, 1);
  const Real distance = world.states()[1].position.x - world.states()[0].position.x;
  test::run(&world, 9);
  EXPECT_NEAR(static_cast<double>(world.states()[1].velocity.x), 1, 1e-3);
  EXPECT_NEAR(static_cast<double>(world.states()[1].position.x - world.states()[0].position.x),
              static_cast<double>(distance), 1e-3);
}

TEST(Friction, AKinematicBoxPushesABox) {
  BodyDef pusher = test::crate({0, 1.01_r, 0}, {2, 1, 2}, 0);
  pusher.kinematic = true;
  pusher.velocity = {1, 0, 0};
  Scene scene;
  scene.bodies = {pusher, test::crate({2.6_r, 0.5_r, 0}, cube()), test::ground()};
  World world(scene);
  test::run(&world, 5);
  EXPECT_NEAR(static_cast<double>(world.states()[1].velocity.x), 1, 1e-3);
  const Real gap = world.states()[1].position.x - world.states()[0].position.x - 2.5_r;
  EXPECT_NEAR(static_cast<double>(gap), 0, 1e-3);
}

}  // namespace
}  // namespace jfpx
