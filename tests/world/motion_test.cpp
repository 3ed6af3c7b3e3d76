/// Tests of worlds against analytic mechanics: fall, flight, bounce, rolling, sliding, impact.
#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace jfpx {
namespace {

using test::operator""_r;
using test::kG;

JFPX_SOLVER_SUITE(Motion);

BodyDef falling(const Vec3& position) {
  BodyDef def = test::ball(position);
  def.acceleration = {0, -9.81_r, 0};
  return def;
}

TEST_P(Motion, FreeFallIsTheDiscreteSumOrTheParabola) {
  Scene scene = test::empty_scene();
  scene.dt = Real(1) / 64;
  scene.bodies = {falling({0, 100, 0})};
  World world(scene);
  const double dt = 1.0 / 64;
  for (int n = 1; n <= 256; ++n) {
    world.step();
    const BodyState s = world.states()[0];
    // v_n = -g n dt, y_n = y_0 - g dt^2 (1 + 2 + ... + n); the soft step has no error.
    const double t = n * dt;
    const double fallen =
        GetParam() == Solver::soft_step ? kG * t * t / 2 : kG * dt * dt * n * (n + 1) / 2;
    ASSERT_NEAR(s.velocity.y, -kG * n * dt, 100 * static_cast<double>(kEpsilon) * n);
    ASSERT_NEAR(s.position.y, 100 - fallen, 100 * static_cast<double>(kEpsilon) * n);
    ASSERT_NEAR(s.position.y, 100 - kG * t * t / 2, kG * t * dt);
  }
}

TEST_P(Motion, ProjectileWithDragFollowsTheGeometricSums) {
  Scene scene = test::empty_scene();
  scene.dt = 0.01_r;
  BodyDef def = falling({0, 0, 0});
  def.velocity = {30, 40, 0};
  def.linear_damping = 0.5_r;
  scene.bodies = {def};
  World world(scene);
  for (int n = 0; n < 300; ++n) world.step();
  const double dt = 0.01 / test::substeps(scene), n = 300 * test::substeps(scene);
  const double q = std::pow(0.5, dt);
  const double qn = std::pow(q, n);
  // v_n = v_0 q^n + a dt q (1 - q^n)/(1 - q); x_n = dt * (v_1 + ... + v_n).
  const double fall = -kG * dt * q / (1 - q);
  const double kept = dt * q * (1 - qn) / (1 - q);
  const BodyState s = world.states()[0];
  EXPECT_NEAR(s.velocity.x, 30 * qn, 1e-3);
  EXPECT_NEAR(s.velocity.y, 40 * qn + fall * (1 - qn), 1e-3);
  // The soft step moves by the mean of the velocities before and after a substep: half of the sum
  // of the changes more.
  const double mean = GetParam() == Solver::soft_step ? dt / 2 : 0;
  const double y_change = 40 - (40 * qn + fall * (1 - qn));
  EXPECT_NEAR(s.position.x, 30 * kept + mean * 30 * (1 - qn), 1e-3);
  EXPECT_NEAR(s.position.y, 40 * kept + fall * (n * dt - kept) + mean * y_change, 2e-3);
}

TEST_P(Motion, BounceReachesTheSquareOfTheRestitutionOfTheHeight) {
  for (const Real e : {Real(0), 0.3_r, 0.5_r, 0.8_r, Real(1)}) {
    Scene scene = test::empty_scene();
    scene.dt = 0.001_r;
    BodyDef def = falling({0, 1 + 5, 0});
    def.restitution = e;
    BodyDef floor = test::ground();
    floor.restitution = e;
    scene.bodies = {def, floor};
    World world(scene);
    bool hit = false;
    double top = 0;
    for (int n = 0; n < 4000; ++n) {
      world.step();
      const BodyState s = world.states()[0];
      hit = hit || !world.contacts().empty();
      if (hit && s.velocity.y < -0.5_r) break;
      if (hit) top = std::max(top, static_cast<double>(s.position.y) - 1);
    }
    // At the impact speed of 9.9 m/s, a step covers 9.9 mm.
    EXPECT_NEAR(top, static_cast<double>(e * e) * 5, 0.02) << "e " << e;
  }
}

TEST_P(Motion, CoefficientsOfTwoBodiesCombineByTheRuleOfTheScene) {
  const struct {
    CombineRule rule;
    double of_half_and_eighth;
  } cases[] = {{CombineRule::geometric_mean, 0.25},
               {CombineRule::product, 0.0625},
               {CombineRule::minimum, 0.125},
               {CombineRule::maximum, 0.5},
               {CombineRule::average, 0.3125}};
  for (const auto& [rule, expected] : cases) {
    // Bounce: an impact at speed 4 without acceleration rebounds at e times 4.
    Scene scene = test::empty_scene();
    BodyDef def = test::ball({0, 1, 0});
    def.velocity = {0, -4, 0};
    def.restitution = 0.5_r;
    BodyDef floor = test::ground();
    floor.restitution = 0.125_r;
    scene.bodies = {def, floor};
    scene.materials.restitution = rule;
    World bouncing(scene);
    bouncing.step();
    EXPECT_NEAR(bouncing.states()[0].velocity.y, 4 * expected, 1e-5) << to_string(rule);
    EXPECT_NEAR(bouncing.contacts()[0].restitution, expected, 1e-7) << to_string(rule);

    // Sliding: the first impact reduces the speed along the ground by mu times 4.
    def.velocity = {30, -4, 0};
    def.restitution = floor.restitution = 0;
    def.friction = 0.125_r;
    floor.friction = 0.5_r;
    scene.bodies = {def, floor};
    scene.materials = {rule, CombineRule::geometric_mean};
    World sliding(scene);
    sliding.step();
    // With soft contacts, friction is limited by the normal impulse before the last sweep, which
    // the relaxation of the springs has reduced by 1.4 %.
    const double lag = GetParam() == Solver::soft_step ? 0.014 : 0;
    EXPECT_NEAR(sliding.states()[0].velocity.x, 30 - 4 * expected, 1e-5 + lag * 4 * expected)
        << to_string(rule);
  }
}

TEST_P(Motion, ABallRollsDownASlopeWithFiveSeventhsOfThePull) {
  const double angle = 0.3;
  Scene scene = test::empty_scene();
  scene.dt = 0.01_r;
  BodyDef def = falling({0, 0, 0});
  def.friction = 1;
  BodyDef slope = test::half_space(
      {static_cast<Real>(std::sin(angle)), static_cast<Real>(std::cos(angle)), 0}, -1);
  slope.friction = 1;
  scene.bodies = {def, slope};
  World world(scene);
  for (int n = 0; n < 300; ++n) world.step();
  const BodyState s = world.states()[0];
  const double expected = 5.0 / 7.0 * kG * std::sin(angle) * 3;
  EXPECT_NEAR(length(s.velocity), expected, 0.01 * expected);
  EXPECT_NEAR(-s.angular_velocity.z, expected, 0.02 * expected);  // rolling: omega r = v
  EXPECT_GT(s.velocity.x, 0);
}

TEST_P(Motion, ASlidingBallLosesTwoSeventhsOfItsSpeedAndThenRolls) {
  Scene scene = test::empty_scene();
  scene.dt = 0.005_r;
  BodyDef def = falling({0, 1, 0});
  def.velocity = {7, 0, 0};
  def.friction = 0.25_r;
  BodyDef floor = test::ground();
  floor.friction = 0.25_r;
  scene.bodies = {def, floor};
  World world(scene);
  // Sliding ends after t = 2 v / (7 mu g); until then the speed decreases with mu g.
  const double end = 2 * 7 / (7 * 0.25 * kG);
  double t = 0;
  for (; t < end / 2; t += 0.005) world.step();
  EXPECT_NEAR(world.states()[0].velocity.x, 7 - 0.25 * kG * t, 0.1);
  for (; t < 2 * end; t += 0.005) world.step();
  const BodyState s = world.states()[0];
  EXPECT_NEAR(s.velocity.x, 5, 0.05);
  EXPECT_NEAR(-s.angular_velocity.z, 5, 0.05);
  // Distance: 12 v^2 / (49 mu g) sliding, then 5 m/s.
  EXPECT_NEAR(s.position.x, 12 * 49 / (49 * 0.25 * kG) + 5 * (t - end), 0.1);
}

TEST_P(Motion, ABallThatCannotRotateSlidesToAStopAfterVSquaredOverTwoMuG) {
  Scene scene = test::empty_scene();
  scene.dt = 0.001_r;
  BodyDef def = falling({0, 1, 0});
  def.velocity = {3, 0, 0};
  def.friction = 0.5_r;
  BodyDef floor = test::ground();
  floor.friction = 0.5_r;
  scene.bodies = {def, floor};
  World world(scene);
  const BodyId id = world.bodies()[0];
  for (int n = 0; n < 1000; ++n) {
    world.step();
    BodyState s = world.state(id);
    s.angular_velocity = {};  // prevents rotation
    world.set_state(id, s);
  }
  EXPECT_NEAR(world.state(id).position.x, 9 / (2 * 0.5 * kG), 0.02);
  EXPECT_NEAR(world.state(id).velocity.x, 0, 0.01);
}

TEST_P(Motion, FrictionTurnsBothBallsTheSameWayInAGlancingHit) {
  Scene scene = test::empty_scene();
  BodyDef a = test::ball({0, 0, 0}), b = test::ball({2.05_r, 0.5_r, 0});
  a.velocity = {6, 0, 0};
  a.friction = b.friction = 0.5_r;
  scene.bodies = {a, b};
  World world(scene);
  for (int n = 0; n < 10; ++n) world.step();
  const auto states = world.states();
  // a passes below b and drags b's underside along +x: both rotate about +z.
  EXPECT_GT(states[0].angular_velocity.z, 0.1_r);
  EXPECT_GT(states[1].angular_velocity.z, 0.1_r);
  EXPECT_NEAR(states[0].angular_velocity.z, states[1].angular_velocity.z, 1e-5);
}

TEST_P(Motion, MomentumIsConservedInACloud) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  Scene scene = test::empty_scene();
  scene.resolver.position_epsilon = 100;  // projections move bodies without momentum
  scene.soft_step.push_out_speed = 1e-6_r;
  for (int i = 0; i < 60; ++i) {
    BodyDef def =
        test::ball(random.uniform_in_box({-4, -4, -4}, {4, 4, 4}), 1, random.uniform(1, 5));
    def.velocity = def.position * Real(-2);
    def.friction = random.uniform();
    def.restitution = random.uniform();
    scene.bodies.push_back(def);
  }
  World world(scene);
  const test::Sums before = test::sums(world);
  std::uint64_t contacts = 0;
  for (int n = 0; n < 60; ++n) contacts += world.step().contacts;
  EXPECT_GT(contacts, 50u);
  const test::Sums after = test::sums(world);
  const double tolerance = 20 * static_cast<double>(kEpsilon) * before.scale;
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(after.momentum[k], before.momentum[k], tolerance);
    // Soft contacts keep the normal of the start of the step, and in a step at 8 m/s the arms turn
    // by 0.13 m in 2 m.
    const double turned = GetParam() == Solver::soft_step ? 0.01 * before.scale : 0;
    EXPECT_NEAR(after.angular_momentum[k], before.angular_momentum[k], tolerance + turned);
  }
}

}  // namespace
}  // namespace jfpx
