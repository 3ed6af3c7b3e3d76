/// Tests of kinematic bodies: they move with given velocities, push and carry other bodies, and are
/// never pushed.
#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace jfpx {
namespace {

using test::operator""_r;
using test::world_with;

JFPX_SOLVER_SUITE(Kinematic);

BodyDef kinematic(const Shape& shape, const Vec3& position, const Vec3& velocity) {
  BodyDef def = test::ball(position);
  def.shape = shape;
  def.mass = 0;
  def.kinematic = true;
  def.velocity = velocity;
  def.friction = 0.5_r;
  return def;
}
/// A platform whose upper side is at y = 0.
BodyDef platform(const Vec3& velocity) { return kinematic(Box{{5, 1, 5}}, {0, -1, 0}, velocity); }
BodyDef cube(const Vec3& position) {
  BodyDef def;
  def.shape = Box{{0.5_r, 0.5_r, 0.5_r}};
  def.position = position;
  def.can_sleep = false;
  return def;
}

JFPX_SOFT_STEP_SUITE(MovingTo);

TEST_P(MovingTo, FollowsThePosesOfAPathAndStopsThere) {
  World world = world_with({kinematic(Box{{1, 1, 1}}, {}, {})});
  const BodyId id = world.bodies()[0];
  const Real dt = world.settings().dt;
  const auto move = [&](const Vec3& position, const Quat& orientation) {
    world.set_state(id, moving_to(world.state(id), position, orientation, dt));
    world.step();
    const BodyState state = world.state(id);
    EXPECT_LT(length(state.position - position), 2e-6_r);
    const Quat error = state.orientation * conjugate(orientation);
    EXPECT_LT(length(Vec3{error.x, error.y, error.z}), 2e-6_r);
  };
  for (const Real angle : {0.08_r, 0.7_r, 1.6_r, 3.1_r}) {  // of a step
    for (int n = 1; n <= 90; ++n) {
      const Real t = static_cast<Real>(n) * dt;
      const Quat q = from_axis_angle({1, 2, 3}, static_cast<Real>(n) * angle);
      move({t, t * t, -t}, n % 2 == 0 ? q : Quat{-q.w, -q.x, -q.y, -q.z});
    }
  }
  const BodyState end = world.state(id);
  const BodyState stopped = moving_to(end, end.position, end.orientation, dt);
  EXPECT_EQ(stopped.velocity, Vec3{});
  EXPECT_EQ(stopped.angular_velocity, Vec3{});
}

TEST(Interpolate, TurnsAlongTheShorterArc) {
  BodyState before, after;
  before.position = {1, 2, 3}, after.position = {3, 2, 1};
  before.velocity = {2, 0, 0}, after.angular_velocity = {0, 4, 0};
  before.orientation = from_axis_angle({0, 0, 1}, 0.2_r);
  const Quat q = from_axis_angle({0, 0, 1}, 0.6_r);
  for (const Quat& same : {q, Quat{-q.w, -q.x, -q.y, -q.z}}) {
    after.orientation = same;
    const BodyState middle = interpolate(before, after, 0.5_r);
    EXPECT_EQ(middle.position, (Vec3{2, 2, 2}));
    EXPECT_EQ(middle.velocity, (Vec3{1, 0, 0}));
    EXPECT_EQ(middle.angular_velocity, (Vec3{0, 2, 0}));
    const Quat expected = from_axis_angle({0, 0, 1}, 0.4_r);
    EXPECT_NEAR(middle.orientation.w, expected.w, 1e-6_r);
    EXPECT_NEAR(middle.orientation.z, expected.z, 1e-6_r);
    EXPECT_EQ(interpolate(before, after, 0).position, before.position);
  }
}

TEST_P(Kinematic, MovesByItsVelocitiesAlone) {
  BodyDef def = kinematic(Sphere{1}, {1, 2, 3}, {0.5_r, 0, -1});
  def.angular_velocity = {0, 0, 1};
  def.acceleration = {9, 9, 9};
  def.linear_damping = def.angular_damping = 0.1_r;
  World world = world_with({def});
  const BodyId id = world.bodies()[0];
  world.apply_force(id, {9, 9, 9});
  world.apply_torque(id, {9, 9, 9});
  world.add_force(Gravity{});
  for (int n = 0; n < 120; ++n) EXPECT_EQ(world.step().awake, 0u);
  const BodyState s = world.state(id);
  EXPECT_EQ(s.velocity, def.velocity);
  EXPECT_EQ(s.angular_velocity, def.angular_velocity);
  EXPECT_NEAR(s.position.x, 2, 1e-4);
  EXPECT_NEAR(s.position.z, 1, 1e-4);
  EXPECT_NEAR(s.orientation.w, std::cos(1.0), 1e-4);
  EXPECT_NEAR(s.orientation.z, std::sin(1.0), 1e-4);
  EXPECT_TRUE(world.awake(id));
}

TEST_P(Kinematic, IsNeverPushedHoweverHeavyTheOther) {
  const BodyDef pusher = kinematic(Sphere{1}, {0, 0, 0}, {1, 0, 0});
  BodyDef truck = test::ball({3, 0, 0}, 1, 1e6_r);
  truck.velocity = {-5, 0, 0};
  World alone = world_with({pusher}), hit = world_with({pusher, truck});
  bool touched = false;
  for (int n = 0; n < 60; ++n) {
    alone.step();
    touched |= hit.step().contacts > 0;
    ASSERT_EQ(hit.states()[0], alone.states()[0]) << n;
  }
  EXPECT_TRUE(touched);
  EXPECT_GT(hit.states()[1].velocity.x, 0.989_r);
}

TEST_P(Kinematic, PushesToItsOwnSpeedAndThrowsWithRestitution) {
  // Hit by an unyielding body at speed 2: leaves at (1 + e) times 2.
  for (const Real e : {Real(0), 0.5_r, Real(1)}) {
    for (const Shape& shape : {Shape(Sphere{1}), Shape(Box{{1, 1, 1}})}) {
      BodyDef pusher = kinematic(shape, {0, 0, 0}, {2, 0, 0});
      BodyDef ball = test::ball({2.01_r, 0, 0});
      pusher.restitution = ball.restitution = e;
      World world = world_with({pusher, ball});
      for (int n = 0; n < 30; ++n) world.step();
      EXPECT_NEAR(world.states()[1].velocity.x, 2 * (1 + e), 0.011) << e;
    }
  }
}

TEST_P(Kinematic, AnElevatorLiftsABodyOnIt) {
  World world = world_with({platform({0, 0.5_r, 0}), cube({0, 0.5_r, 0}), cube({0, 1.5_r, 0})});
  for (int n = 0; n < 240; ++n) world.step();
  const auto states = world.states();
  EXPECT_NEAR(states[0].position.y, -1 + 2, 1e-3);
  EXPECT_NEAR(states[1].position.y, 0.5 + 2, 0.02);
  EXPECT_NEAR(states[2].position.y, 1.5 + 2, 0.04);
  EXPECT_NEAR(states[1].velocity.y, 0.5, 0.02);
}

TEST_P(Kinematic, AConveyorDragsByFriction) {
  World world = world_with({platform({2, 0, 0}), cube({0, 0.5_r, 0})});
  // Friction 0.5 accelerates with g/2: at speed 2 after 0.41 s.
  for (int n = 0; n < 12; ++n) world.step();
  EXPECT_NEAR(world.states()[1].velocity.x, 0.5 * 9.81 * 0.2, 0.1);
  for (int n = 0; n < 48; ++n) world.step();
  EXPECT_NEAR(world.states()[1].velocity.x, 2, 0.02);
}

TEST_P(Kinematic, ATurntableCarriesABoxAround) {
  BodyDef table = platform({});
  table.angular_velocity = {0, 1, 0};
  BodyDef passenger = cube({1, 0.5_r, 0});
  passenger.velocity = {0, 0, -1};
  passenger.angular_velocity = {0, 1, 0};
  World world = world_with({table, passenger});
  for (int n = 0; n < 60; ++n) world.step();  // 1 rad from x towards -z
  const Vec3 at = world.states()[1].position;
  EXPECT_NEAR(std::atan2(-at.z, at.x), 1, 0.05);
  EXPECT_NEAR(std::hypot(at.x, at.z), 1, 0.05);
}

TEST_P(Kinematic, ABodyThatItCarriesSlowlyStaysAwakeUntilItStops) {
  // 0.1 m/s is far below the sleep epsilon; a body that fell asleep would lose its speed.
  std::vector<BodyDef> bodies = {platform({0.1_r, 0, 0})};
  for (int i = 0; i < 3; ++i) {
    bodies.push_back(cube({0, 0.5_r + static_cast<Real>(i), 0}));
    bodies.back().can_sleep = true;
  }
  World world = world_with(bodies);
  for (int n = 0; n < 60; ++n) world.step();
  for (int n = 0; n < 240; ++n) {
    ASSERT_EQ(world.step().awake, 3u) << n;
    for (std::size_t i = 1; i < 4; ++i) {
      ASSERT_NEAR(world.states()[i].velocity.x, 0.1, 0.03) << n;
    }
  }
  const BodyId id = world.bodies()[0];
  BodyState s = world.state(id);
  s.velocity = {};
  world.set_state(id, s);
  EXPECT_FALSE(world.awake(id));
  StepReport report;
  for (int n = 0; n < 240; ++n) report = world.step();
  EXPECT_EQ(report.awake, 0u);

  // It wakes when the platform starts again.
  s = world.state(id);
  s.velocity = {1, 0, 0};
  world.set_state(id, s);
  EXPECT_EQ(world.step().awake, 3u);
}

TEST_P(Kinematic, WakesASleepingBodyThatItHits) {
  BodyDef sleeper = test::ball({5, 0, 0});
  sleeper.can_sleep = true;
  World world = world_with({kinematic(Box{{1, 1, 1}}, {0, 0, 0}, {2, 0, 0}), sleeper});
  const BodyId id = world.bodies()[1];
  for (int n = 0; n < 85; ++n) world.step();
  ASSERT_FALSE(world.awake(id));
  for (int n = 0; n < 10; ++n) world.step();
  EXPECT_TRUE(world.awake(id));
  EXPECT_NEAR(world.state(id).velocity.x, 2, 0.011);
}

TEST_P(Kinematic, ASpringFromItWakesTheBodyAtItsOtherEnd) {
  BodyDef sleeper = test::ball({5, 0, 0});
  sleeper.can_sleep = true;
  World world = world_with({kinematic(Sphere{1}, {0, 0, 0}, {}), sleeper});
  const BodyId puller = world.bodies()[0], pulled = world.bodies()[1];
  world.add_force(Spring{.a = {puller}, .b = {pulled}, .stiffness = 5, .rest_length = 5});
  for (int n = 0; n < 120; ++n) world.step();
  ASSERT_FALSE(world.awake(pulled));
  world.set_state(puller, {{0, 0, 0}, {}, {-1, 0, 0}, {}});
  for (int n = 0; n < 60; ++n) world.step();
  EXPECT_LT(world.state(pulled).velocity.x, -0.1_r);
}

TEST_P(Kinematic, PassesThroughImmovableBodies) {
  World world = world_with({kinematic(Sphere{1}, {0, 3, 0}, {0, -2, 0}),
                            kinematic(Box{{1, 1, 1}}, {0, -3, 0}, {0, 2, 0}), test::ground()});
  for (int n = 0; n < 120; ++n) EXPECT_EQ(world.step().contacts, 0u);
  EXPECT_NEAR(world.states()[0].position.y, -1, 1e-3);
}

TEST_P(Kinematic, AFailedStepRestoresItsState) {
  World world = world_with({kinematic(Sphere{1}, {0.99e9_r, 0, 0}, {9e7_r, 0, 0})});
  const auto before = world.states();
  StepReport report;
  for (int n = 0; n < 60 && !report.non_finite; ++n) report = world.step();
  EXPECT_TRUE(report.non_finite);
  EXPECT_EQ(report.non_finite_body, world.bodies()[0]);
  const auto stopped = world.states();
  EXPECT_NE(stopped, before);
  world.step();
  EXPECT_EQ(world.states(), stopped);
}

}  // namespace
}  // namespace jfpx
