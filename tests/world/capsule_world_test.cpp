/// Capsules in worlds: they rest, stack, roll and fall over as rigid bodies do.
#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace jfpx {
namespace {

using test::operator""_r;

BodyDef capsule_at(const Vec3& position, const Quat& orientation, Real radius, Real half_height) {
  BodyDef def;
  def.shape = Capsule{radius, half_height};
  def.position = position;
  def.orientation = orientation;
  return def;
}
/// The axis is the x axis of the world.
const Quat kLying = normalized(Quat{1, 0, 0, 1});

Scene ground_scene() {
  Scene scene;
  BodyDef ground;
  ground.shape = Box{{10, 0.5_r, 10}};
  ground.position = {0, -0.5_r, 0};
  ground.mass = 0;
  scene.bodies.push_back(ground);
  return scene;
}

World after(const Scene& scene, double seconds) {
  World world(scene);
  for (int n = 0; n < static_cast<int>(seconds * 60); ++n) world.step();
  return world;
}

TEST(CapsuleWorld, ALyingCapsuleRestsOnTwoPointsAndSleeps) {
  Scene scene = ground_scene();
  scene.bodies.push_back(capsule_at({0, 0.3_r, 0}, kLying, 0.2_r, 0.5_r));
  const World world = after(scene, 2);
  const BodyId body = world.bodies()[1];
  EXPECT_FALSE(world.awake(body));
  EXPECT_EQ(world.contacts().size(), 2u);
  const BodyState state = world.state(body);
  EXPECT_NEAR(state.position.y, 0.2, 1e-3);
  EXPECT_NEAR(state.position.x, 0, 1e-3);
  EXPECT_NEAR(state.position.z, 0, 1e-3);
}

TEST(CapsuleWorld, ACapsuleOnItsEndFallsOver) {
  Scene scene = ground_scene();
  scene.bodies.push_back(
      capsule_at({0, 0.7_r, 0}, normalized(Quat{1, 0, 0, 0.01_r}), 0.2_r, 0.5_r));
  const World world = after(scene, 5);
  const BodyState state = world.state(world.bodies()[1]);
  EXPECT_NEAR(state.position.y, 0.2, 1e-2);
  EXPECT_NEAR(to_matrix(state.orientation).column(1).y, 0, 1e-2);
}

/// A pile of logs: capsules on two others, in three layers.
TEST(CapsuleWorld, LogsStackAndSleep) {
  Scene scene = ground_scene();
  const Real r = 0.2_r;
  for (int layer = 0; layer < 3; ++layer) {
    const Quat q = layer % 2 == 0 ? kLying : normalized(Quat{1, 1, 0, 0});
    for (const Real side : {-0.5_r, 0.5_r}) {
      const Vec3 across = layer % 2 == 0 ? Vec3{0, 0, side} : Vec3{side, 0, 0};
      BodyDef log = capsule_at(Vec3{0, r * static_cast<Real>(2 * layer + 1), 0} + across, q, r, 1);
      log.rolling_friction = 0.01_r;
      scene.bodies.push_back(log);
    }
  }
  const World world = after(scene, 6);
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
    const BodyId body = world.bodies()[i];
    EXPECT_FALSE(world.awake(body)) << i;
    EXPECT_LT(length(world.state(body).position - scene.bodies[i].position), 0.02_r) << i;
  }
}

/// g sin(a) / (1 + I / (m r^2)).
TEST(CapsuleWorld, RollsDownASlopeAsItsInertiaSays) {
  const Real slope = 0.2_r;
  Scene scene;
  BodyDef plane = test::half_space(normalized(Vec3{slope, 1, 0}), 0);
  plane.friction = 1;
  const Vec3 normal = std::get<HalfSpace>(plane.shape).normal;
  BodyDef log = capsule_at(normal * 0.2_r, normalized(Quat{1, 1, 0, 0}), 0.2_r, 0.5_r);
  log.friction = 1;
  log.can_sleep = false;
  scene.bodies = {plane, log};
  World world(scene);
  const Mat3 inertia = world.inertia(world.bodies()[1]);
  const double k = static_cast<double>(inertia(1, 1)) / (0.2 * 0.2);
  const double sine = static_cast<double>(normal.x);
  const double acceleration = 9.81 * sine / (1 + k);
  for (int n = 0; n < 120; ++n) world.step();
  const double speed = static_cast<double>(length(world.state(world.bodies()[1]).velocity));
  EXPECT_NEAR(speed, 2 * acceleration, 0.01 * speed);
}

TEST(CapsuleWorld, FloatsAsDeepAsItsMassSays) {
  Scene scene;
  const Capsule capsule{0.3_r, 1};
  BodyDef log = capsule_at({0, 0, 0}, kLying, capsule.radius, capsule.half_height);
  const Real volume = kPi * 0.09_r * (2 + 0.4_r);
  log.mass = 500 * volume;
  log.linear_damping = log.angular_damping = 0.3_r;
  scene.bodies.push_back(log);
  World world(scene);
  world.add_force(Buoyancy{.liquid = {{0, 1, 0}, 0}, .density = 1000, .gravity = 9.81_r});
  for (int n = 0; n < 1200; ++n) world.step();
  EXPECT_NEAR(world.state(world.bodies()[0]).position.y, 0, 0.01);
}

}  // namespace
}  // namespace jfpx
