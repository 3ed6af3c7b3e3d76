/// Tests of conveyors, kinematic bodies with locked axes: they keep their pose, and what they touch
/// moves as on a moving surface.
#include "tests/world/random_bodies.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace jfpx {
namespace {

using test::operator""_r;

constexpr double kGravity = 9.81;

/// A plate of 40 m x 2 m x 40 m with its top at y = 0 that keeps its pose.
BodyDef conveyor(const Vec3& velocity, const Vec3& angular_velocity = {}) {
  BodyDef def;
  def.shape = Box{{20, 1, 20}};
  def.mass = 0;
  def.kinematic = true;
  def.position = {0, -1, 0};
  def.velocity = velocity;
  def.angular_velocity = angular_velocity;
  def.motion_locks = kFixedPose;
  return def;
}
BodyDef passenger(const Shape& shape, const Vec3& position) {
  BodyDef def;
  def.shape = shape;
  def.position = position;
  def.can_sleep = false;
  return def;
}
World world_with(const std::vector<BodyDef>& bodies) {
  Scene scene;
  scene.bodies = bodies;
  scene.solver = Solver::soft_step;
  return World(scene);
}
void expect_pose(const World& world, std::size_t body, const BodyDef& def) {
  EXPECT_EQ(world.states()[body].position, def.position);
  EXPECT_EQ(world.states()[body].orientation, def.orientation);
  EXPECT_EQ(world.states()[body].velocity, def.velocity);
  EXPECT_EQ(world.states()[body].angular_velocity, def.angular_velocity);
}

/// Friction mu accelerates a box by mu g to the speed of the belt. It falls behind by v^2 / (2 mu
/// g).
TEST(Conveyor, DragsABoxByFrictionAndKeepsItsPose) {
  const BodyDef belt = conveyor({2, 0, 0});
  World world = world_with({belt, passenger(Box{{0.5_r, 0.2_r, 0.5_r}}, {0, 0.2_r, 0})});
  const double acceleration = 0.5 * kGravity;
  for (int n = 0; n < 18; ++n) world.step();
  EXPECT_NEAR(world.states()[1].velocity.x, acceleration * 0.3, 0.02);
  for (int n = 18; n < 120; ++n) world.step();
  EXPECT_NEAR(world.states()[1].velocity.x, 2, 0.001);
  EXPECT_NEAR(world.states()[1].position.x, 2 * 2 - 4 / (2 * acceleration), 0.02);
  EXPECT_NEAR(world.states()[1].position.y, 0.2, 0.001);
  expect_pose(world, 0, belt);
}

/// Renormalization of the orientation must not change its bits.
TEST(Conveyor, KeepsTheBitsOfATiltedPose) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  std::vector<BodyDef> belts;
  for (int i = 0; i < 20; ++i) {
    belts.push_back(conveyor({1, 2, 3}, {3, 2, 1}));
    belts.back().position = random.uniform_in_box({-99, -99, -99}, {99, 99, 99});
    belts.back().orientation = test::random_rotation(&random);
  }
  World world = world_with(belts);
  const auto before = world.states();
  const std::vector<BodyState> first(before.begin(), before.end());
  for (int n = 0; n < 100; ++n) world.step();
  for (std::size_t i = 0; i < first.size(); ++i) EXPECT_EQ(world.states()[i], first[i]);
}

/// The impulse J of friction gives a ball the velocity u = J / m and the spin w r = 5/2 u. It rolls
/// when u + w r is the velocity of the belt.
TEST(Conveyor, GivesABallTwoSeventhsOfItsSpeed) {
  World world = world_with({conveyor({0, 0, 3}), passenger(Sphere{0.5_r}, {0, 0.5_r, 0})});
  for (int n = 0; n < 120; ++n) world.step();
  EXPECT_NEAR(world.states()[1].velocity.z, 3 * 2 / 7.0, 0.01);
  EXPECT_NEAR(world.states()[1].angular_velocity.x, -3 * 5 / 7.0 / 0.5, 0.02);
}

/// A ball that rolls on a turntable moves in a circle with 2/7 of its angular velocity (Weltner
/// 1979).
TEST(Conveyor, ABallRollsInACircleOnATurntable) {
  const BodyDef table = conveyor({}, {0, 2, 0});
  BodyDef ball = passenger(Sphere{0.5_r}, {3, 0.5_r, 0});
  // Without slip: the velocity at the contact, v + w x (0, -r, 0), is that of the table.
  ball.velocity = {0, 0, 1};
  const Real surface = -2 * 3;  // the z component of (0, 2, 0) x (3, 0, 0)
  ball.angular_velocity = {(1 - surface) / 0.5_r, 0, 0};
  World world = world_with({table, ball});
  const double rate = 2 * 2 / 7.0;
  double farthest = 0;
  const int steps = static_cast<int>(std::lround(2 * 3.14159265358979 / rate * 60));
  for (int n = 0; n < steps; ++n) {
    world.step();
    const Vec3 v = world.states()[1].velocity;
    EXPECT_NEAR(length(v), 1, 0.05) << n;
    farthest =
        std::max(farthest, static_cast<double>(length(world.states()[1].position - ball.position)));
  }
  EXPECT_NEAR(length(world.states()[1].position - ball.position), 0, 0.1);  // a full circle
  EXPECT_NEAR(farthest, 2 / rate, 0.1);                                     // its diameter
  expect_pose(world, 0, table);
}

TEST(Conveyor, ATurntableThatIsNotRoundCarriesABoxAround) {
  BodyDef box = passenger(Box{{0.5_r, 0.2_r, 0.5_r}}, {2, 0.2_r, 0});
  box.velocity = {0, 0, -2};
  box.angular_velocity = {0, 1, 0};
  World world = world_with({conveyor({}, {0, 1, 0}), box});
  for (int n = 0; n < 60; ++n) world.step();  // 1 rad from x towards -z
  const Vec3 at = world.states()[1].position;
  EXPECT_NEAR(std::atan2(-at.z, at.x), 1, 0.05);
  EXPECT_NEAR(std::hypot(at.x, at.z), 2, 0.05);
}

/// A lift that is a conveyor moves along its free axis only.
TEST(Conveyor, MovesAlongFreeAxes) {
  BodyDef lift = conveyor({1, 0.5_r, 0});
  lift.motion_locks = {.linear_x = true};
  World world = world_with({lift, passenger(Box{{0.5_r, 0.2_r, 0.5_r}}, {0, 0.2_r, 0})});
  for (int n = 0; n < 60; ++n) world.step();
  const BodyState moved = world.states()[0];
  EXPECT_EQ(moved.position.x, 0);
  EXPECT_NEAR(moved.position.y, -0.5, 1e-4);
  EXPECT_NEAR(world.states()[1].position.y, 0.7, 0.01);
  EXPECT_NEAR(world.states()[1].velocity.x, 1, 0.01);
}

TEST(Conveyor, KeepsBodiesAwakeWhileItMoves) {
  BodyDef box = passenger(Box{{0.5_r, 0.2_r, 0.5_r}}, {0, 0.2_r, 0});
  box.can_sleep = true;
  World world = world_with({conveyor({0.01_r, 0, 0}), box});
  StepReport report;
  for (int n = 0; n < 240; ++n) report = world.step();
  EXPECT_EQ(report.awake, 1u);
  const BodyId belt = world.bodies()[0];
  BodyState stopped = world.state(belt);
  stopped.velocity = {};
  world.set_state(belt, stopped);
  for (int n = 0; n < 240; ++n) report = world.step();
  EXPECT_EQ(report.awake, 0u);
  stopped.velocity = {1, 0, 0};
  world.set_state(belt, stopped);
  for (int n = 0; n < 60; ++n) report = world.step();
  EXPECT_EQ(report.awake, 1u);
  EXPECT_NEAR(world.states()[1].velocity.x, 1, 0.01);
}

/// Locks that are set later, or kept in a snapshot, are those of a definition.
TEST(Conveyor, LocksCanBeChangedAndAreInSnapshots) {
  BodyDef belt = conveyor({1, 0, 0}, {0, 0.5_r, 0});
  const BodyDef box = passenger(Box{{0.5_r, 0.2_r, 0.5_r}}, {2, 0.2_r, 0});
  World defined = world_with({belt, box});
  belt.motion_locks = {};
  World changed = world_with({belt, box});
  changed.set_motion_locks(changed.bodies()[0], kFixedPose);
  EXPECT_EQ(changed.motion_locks(changed.bodies()[0]), kFixedPose);
  for (int n = 0; n < 30; ++n) defined.step(), changed.step();
  EXPECT_EQ(changed.state_hash(), defined.state_hash());
  World restored = world_with({});
  restored.restore(defined.snapshot());
  for (int n = 0; n < 30; ++n) defined.step(), restored.step();
  EXPECT_EQ(restored.state_hash(), defined.state_hash());

  changed.set_motion_locks(changed.bodies()[0], {});
  changed.step();
  EXPECT_GT(changed.states()[0].position.x, 0);
}

}  // namespace
}  // namespace jfpx
