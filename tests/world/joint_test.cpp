/// Motion of bodies with joints, against mechanics.
#include "tests/world/joint_scene.hpp"
#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

namespace jfpx {
namespace {

using test::ball;
using test::body;
using test::kG;
using test::kPiD;
using test::operator""_r;

/// A joint of body `a` with the world, whose anchor is the origin.
DistanceJoint rod(std::uint32_t a, Real length) {
  return {.a = body(a), .min_length = length, .max_length = length};
}
DistanceJoint rope(std::uint32_t a, std::optional<BodyId> b, Real length) {
  return {.a = body(a), .b = b, .max_length = length};
}

BodyDef falling_ball(const Vec3& position, Real radius = 0.03_r) {
  BodyDef def = ball(position, radius);
  def.acceleration = {0, -9.81_r, 0};
  return def;
}

Scene pendulum(double angle) {
  Scene scene;
  scene.bodies = {
      falling_ball({static_cast<Real>(std::sin(angle)), -static_cast<Real>(std::cos(angle)), 0})};
  scene.joints = {rod(0, 1)};
  return scene;
}

double energy_of(const BodyState& state) {
  return 0.5 * static_cast<double>(length_squared(state.velocity)) +
         kG * static_cast<double>(state.position.y);
}

TEST(Joint, APendulumKeepsItsAmplitude) {
  const double angle = 10 * kPiD / 180;
  World world(pendulum(angle));
  double last_amplitude = 0, longest_error = 0;
  for (int n = 0; n < 60 * 60; ++n) {
    world.step();
    const Vec3 x = world.states()[0].position;
    const double now = std::atan2(static_cast<double>(x.x), -static_cast<double>(x.y));
    if (n >= 57 * 60) last_amplitude = std::max(last_amplitude, std::abs(now));
    longest_error = std::max(longest_error, std::abs(static_cast<double>(length(x)) - 1));
  }
  EXPECT_NEAR(last_amplitude / angle, 1, 0.01);
  EXPECT_LT(longest_error, 1e-5);
}

/// Ten revolutions per second: a quarter of a radian per substep.
TEST(Joint, AFastPendulumKeepsItsEnergyAndItsLength) {
  Scene scene = pendulum(0);
  scene.bodies[0].velocity = {60, 0, 0};
  World world(scene);
  const double energy = energy_of({scene.bodies[0].position, {}, scene.bodies[0].velocity, {}});
  for (int n = 0; n < 20 * 60; ++n) {
    world.step();
    ASSERT_NEAR(energy_of(world.states()[0]) / energy, 1, 2e-3) << n;
    ASSERT_NEAR(static_cast<double>(world.joint_state(world.joints()[0]).length), 1, 1e-4) << n;
  }
  // The force that keeps the ball on the circle.
  const double force = static_cast<double>(world.joint_state(world.joints()[0]).tension);
  EXPECT_NEAR(force / 3600, 1, 0.02);
}

/// A rigid body that hangs by a point beside its centre: the period is that of its inertia.
TEST(Joint, APhysicalPendulumSwingsWithItsPeriod) {
  Scene scene;
  BodyDef bar = falling_ball({});
  bar.shape = Box{{0.05_r, 0.5_r, 0.05_r}};
  const double angle = 0.1;
  bar.orientation = {static_cast<Real>(std::cos(angle / 2)), 0, 0,
                     static_cast<Real>(std::sin(angle / 2))};
  bar.position = {static_cast<Real>(std::sin(angle)), -static_cast<Real>(std::cos(angle)), 0};
  scene.bodies = {bar};
  DistanceJoint joint = rod(0, 0.5_r);
  joint.anchor_a = {0, 0.5_r, 0};
  scene.joints = {joint};
  World world(scene);
  // A double pendulum of a rod without mass and a bar, whose slow mode swings nearly as one body.
  const double inertia = 1 + (4 * 0.25 + 4 * 0.0025) / 12;
  const double period = 2 * kPiD * std::sqrt(inertia / kG);
  std::vector<double> crossings;
  double before = angle;
  for (int n = 1; n <= 20 * 60; ++n) {
    world.step();
    const auto x = static_cast<double>(world.states()[0].position.x);
    if (before > 0 && x <= 0) crossings.push_back((n - x / (x - before)) / 60);
    before = x;
  }
  ASSERT_GT(crossings.size(), 5u);
  const double measured =
      (crossings.back() - crossings.front()) / static_cast<double>(crossings.size() - 1);
  EXPECT_NEAR(measured / period, 1, 0.02);
}

TEST(Joint, AHangingChainKeepsItsLength) {
  constexpr std::uint32_t kLinks = 20;
  constexpr Real kLink = 0.25_r;
  Scene scene;
  for (std::uint32_t i = 0; i < kLinks; ++i) {
    scene.bodies.push_back(falling_ball({0, -kLink * static_cast<Real>(i + 1), 0}));
    scene.joints.push_back(rope(i, i > 0 ? std::optional(body(i - 1)) : std::nullopt, kLink));
  }
  World world(scene);
  double longest = 0;
  for (int n = 0; n < 30 * 60; ++n) {
    world.step();
    const double all = -static_cast<double>(world.states().back().position.y);
    ASSERT_NEAR(all / (kLinks * static_cast<double>(kLink)), 1, 0.01) << n;
    if (n < 20 * 60) continue;
    for (const JointId id : world.joints()) {
      longest = std::max(longest, static_cast<double>(world.joint_state(id).length));
    }
  }
  EXPECT_LT(longest / static_cast<double>(kLink), 1.001);
  // The first link carries all balls.
  EXPECT_NEAR(static_cast<double>(world.joint_state(world.joints()[0]).tension) / (kLinks * kG), 1,
              0.01);
}

TEST(Joint, ASlackRopeHasNoForceAndATautOneStopsTheBody) {
  Scene scene;
  scene.bodies = {falling_ball({0, 0, 0})};
  scene.joints = {rope(0, std::nullopt, 1)};
  World world(scene);
  const JointId id = world.joints()[0];
  // It falls by 1 m in 0.45 s.
  for (int n = 0; n < 25; ++n) {
    world.step();
    ASSERT_EQ(world.joint_state(id).tension, 0) << n;
    const double t = (n + 1) / 60.0, fallen = kG * t * (t + 1 / 240.0) / 2;
    ASSERT_NEAR(-static_cast<double>(world.states()[0].position.y), fallen, 1e-4) << n;
  }
  for (int n = 0; n < 35; ++n) {
    world.step();
    ASSERT_LT(world.joint_state(id).length, 1.01_r) << n;
  }
  EXPECT_NEAR(static_cast<double>(world.joint_state(id).tension), kG, 0.05);
  EXPECT_NEAR(static_cast<double>(length(world.states()[0].velocity)), 0, 1e-3);
}

TEST(Joint, TheLowerLimitHoldsBodiesApart) {
  Scene scene;
  scene.bodies = {ball({0, 0, 0}, 0.1_r), ball({2, 0, 0}, 0.1_r)};
  scene.bodies[0].velocity = {3, 0, 0};
  scene.joints = {DistanceJoint{.a = body(0), .b = body(1), .min_length = 1, .max_length = 3}};
  World world(scene);
  Real shortest = 2;
  for (int n = 0; n < 120; ++n) {
    world.step();
    shortest = std::min(shortest, world.joint_state(world.joints()[0]).length);
  }
  EXPECT_GT(shortest, 0.999_r);
  // The impact is inelastic.
  EXPECT_NEAR(static_cast<double>(world.states()[0].velocity.x), 1.5, 1e-3);
  EXPECT_NEAR(static_cast<double>(world.states()[1].velocity.x), 1.5, 1e-3);
}

struct Oscillator {
  Real hertz, damping_ratio;
};
class SpringOfJoint : public testing::TestWithParam<Oscillator> {};
INSTANTIATE_TEST_SUITE_P(Joint, SpringOfJoint,
                         testing::Values(Oscillator{1, 0}, Oscillator{0.5_r, 0.1_r},
                                         Oscillator{2, 0.3_r}, Oscillator{5, 0},
                                         Oscillator{8, 0.05_r}));

/// Two bodies of unequal masses, against the solution of the damped oscillator.
TEST_P(SpringOfJoint, OscillatesWithItsFrequencyAndDampingRatio) {
  const auto [hertz, ratio] = GetParam();
  Scene scene;
  scene.bodies = {ball({0, 0, 0}, 0.05_r, 1), ball({1, 0, 0}, 0.05_r, 3)};
  scene.joints = {DistanceJoint{
      .a = body(0), .b = body(1), .rest_length = 0.8_r, .hertz = hertz, .damping_ratio = ratio}};
  World world(scene);
  const double omega = 2 * kPiD * static_cast<double>(hertz), z = static_cast<double>(ratio);
  const double damped = omega * std::sqrt(1 - z * z);
  for (int n = 1; n <= 5 * 60; ++n) {
    world.step();
    // Semi-implicit Euler is half a substep ahead.
    const double t = n / 60.0 + 0.5 / 240;
    const double expected = 0.2 * std::exp(-z * omega * t) *
                            (std::cos(damped * t) + z * omega / damped * std::sin(damped * t));
    const auto length = static_cast<double>(world.joint_state(world.joints()[0]).length);
    ASSERT_NEAR(length - 0.8, expected, 0.008) << n;
  }
}

TEST(Joint, AStiffSpringIsStable) {
  Scene scene;
  scene.bodies = {ball({0, 0, 0}, 0.05_r), ball({1, 0, 0}, 0.05_r)};
  scene.joints = {DistanceJoint{
      .a = body(0), .b = body(1), .rest_length = 0.5_r, .hertz = 1e6_r, .damping_ratio = 1}};
  World world(scene);
  for (int n = 0; n < 60; ++n) ASSERT_FALSE(world.step().non_finite);
  EXPECT_NEAR(static_cast<double>(world.joint_state(world.joints()[0]).length), 0.5, 1e-3);
}

/// Free bodies with joints of all kinds at any points keep their momentum. Corrections of lengths,
/// which have no velocity, may change the angular momentum a little.
TEST(Joint, MomentumIsKeptToRounding) {
  Scene scene;
  for (std::uint32_t i = 0; i < 6; ++i) {
    BodyDef def = ball({static_cast<Real>(i), 0.3_r * static_cast<Real>(i % 2), 0}, 0.2_r,
                       1 + static_cast<Real>(i));
    def.velocity = {0, static_cast<Real>(i) - 2, 0.5_r};
    def.angular_velocity = {1, 0, static_cast<Real>(i)};
    scene.bodies.push_back(def);
  }
  for (std::uint32_t i = 1; i < 6; ++i) {
    DistanceJoint joint{.a = body(i), .b = body(i - 1)};
    joint.anchor_a = {0, 0.2_r, 0};
    joint.max_length = 1.2_r;
    if (i % 2 == 0) joint.min_length = joint.max_length;
    if (i == 5) joint.hertz = 2;
    scene.joints.push_back(joint);
  }
  World world(scene);
  const test::Sums before = test::sums(world);
  for (int n = 0; n < 300; ++n) world.step();
  const test::Sums after = test::sums(world);
  EXPECT_NE(before.energy, after.energy);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(after.momentum[k], before.momentum[k], 3000 * test::kEps * before.scale) << k;
    EXPECT_NEAR(after.angular_momentum[k], before.angular_momentum[k], 0.01 * before.scale) << k;
  }
}

TEST(Joint, TwoBodiesThatWhirlOnARodKeepTheirAngularMomentum) {
  Scene scene;
  scene.bodies = {ball({0, 0, 0}, 0.1_r, 1), ball({1, 0, 0}, 0.1_r, 3)};
  scene.bodies[0].velocity = {0, 3, 0};
  scene.bodies[1].velocity = {0, -1, 0};
  scene.joints = {DistanceJoint{.a = body(0), .b = body(1), .min_length = 1, .max_length = 1}};
  World world(scene);
  const test::Sums before = test::sums(world);
  for (int n = 0; n < 600; ++n) world.step();
  const test::Sums after = test::sums(world);
  EXPECT_NEAR(after.angular_momentum[2] / before.angular_momentum[2], 1, 3000 * test::kEps);
  EXPECT_NEAR(after.energy / before.energy, 1, 1e-3);
}

TEST(Joint, AKinematicBodyDragsWhatIsJoinedWithIt) {
  Scene scene;
  BodyDef carrier = ball({0, 0, 0}, 0.1_r, 0);
  carrier.kinematic = true;
  carrier.velocity = {2, 0, 0};
  scene.bodies = {carrier, ball({0, -1, 0}, 0.1_r)};
  scene.joints = {rope(1, body(0), 1.5_r)};
  World world(scene);
  for (int n = 0; n < 300; ++n) {
    world.step();
    ASSERT_LT(world.joint_state(world.joints()[0]).length, 1.51_r) << n;
  }
  EXPECT_GT(world.states()[1].position.x, 8);
}

TEST(Joint, AnchorsThatCoincideArePushedApartAlongTheXAxis) {
  Scene scene;
  scene.bodies = {ball({1, 2, 3}, 0.1_r), ball({1, 2, 3}, 0.1_r)};
  scene.joints = {DistanceJoint{.a = body(0), .b = body(1), .min_length = 0.5_r}};
  World world(scene);
  for (int n = 0; n < 120; ++n) ASSERT_FALSE(world.step().non_finite);
  const auto states = world.states();
  EXPECT_NEAR(static_cast<double>(states[0].position.x - states[1].position.x), 0.5, 1e-3);
  EXPECT_EQ(states[0].position.y, 2);
}

/// More joints than colors at one body.
TEST(Joint, ABodyWithTenThousandJoints) {
  constexpr std::uint32_t kJoints = 10000;
  Scene scene;
  scene.bodies = {ball({}, 1, 1000)};
  for (std::uint32_t i = 1; i <= kJoints; ++i) {
    const double turn = 2.4 * i, y = 2.0 * i / kJoints - 1, r = std::sqrt(1 - y * y);
    const Vec3 direction{static_cast<Real>(r * std::cos(turn)), static_cast<Real>(y),
                         static_cast<Real>(r * std::sin(turn))};
    scene.bodies.push_back(ball(direction * 40, 0.05_r));
    scene.bodies.back().velocity = direction * 10 + Vec3{1, 0, 0};
    scene.joints.push_back(rope(i, body(0), 40.2_r));
  }
  World world(scene);
  for (int n = 0; n < 8; ++n) ASSERT_FALSE(world.step().non_finite);
  Real longest = 0;
  for (const JointId id : world.joints()) {
    longest = std::max(longest, world.joint_state(id).length);
  }
  EXPECT_LT(longest, 40.25_r);
  EXPECT_NEAR(test::sums(world).momentum[0], kJoints, 1);
}

}  // namespace
}  // namespace jfpx
