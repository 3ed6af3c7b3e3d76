/// Tests of worlds with Solver::worst_first: impacts, corrections, sleep.
#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace jfpx {
namespace {

using test::operator""_r;

TEST(Motion, NewtonsCradleReleasesAsManyBallsAsHitIt) {
  for (const std::size_t coming : {1u, 2u, 3u}) {
    Scene scene = test::thesis_scene();
    scene.dt = 0.001_r;
    for (std::size_t i = 0; i < 5; ++i) {
      BodyDef def = test::ball({2 * static_cast<Real>(i), 0, 0});
      def.restitution = 1;
      if (i < coming) {
        def.position.x -= 0.0025_r;
        def.velocity = {2, 0, 0};
      }
      scene.bodies.push_back(def);
    }
    World world(scene);
    const test::Sums before = test::sums(world);
    for (int n = 0; n < 20; ++n) ASSERT_FALSE(world.step().iterations_exhausted);
    const auto states = world.states();
    for (std::size_t i = 0; i < 5; ++i) {
      EXPECT_NEAR(states[i].velocity.x, i + coming >= 5 ? 2 : 0, 0.011) << i << " of " << coming;
    }
    const test::Sums after = test::sums(world);
    EXPECT_NEAR(after.momentum[0], before.momentum[0], 1e-5 * before.scale);
    EXPECT_NEAR(after.energy, before.energy, 0.02 * before.energy);
  }
}

TEST(Motion, FirstHitOfTheTowerIsWhenTheSecondBallHasFallenOntoTheFirst) {
  Scene scene = test::thesis_scene();
  scene.dt = 0.01_r;
  for (int i = 0; i < 8; ++i) {
    const Real y = 1 + 3 * static_cast<Real>(i);
    BodyDef def = test::ball({0.1_r * y, y, 0}, 1, 20);
    def.acceleration = {0, -9.8_r, 0};
    def.linear_damping = 0.99_r;
    def.can_sleep = true;
    scene.bodies.push_back(def);
  }
  scene.bodies.push_back(test::ground());
  World world(scene);
  int first = 0;
  for (int n = 1; n <= 100 && first == 0; ++n) {
    if (world.step().sphere_contacts > 0) first = n;
  }
  // The centres are 0.3 apart along x, so they touch at a height of sqrt(4 - 0.09). Ball 0 lies on
  // the ground, at most epsilon = 0.01 deep: both ends of that range.
  const auto touching_step = [](double lowest) {
    const double kept = std::pow(0.99, 0.01);
    double y = 4, v = 0;
    for (int n = 1;; ++n) {
      v = (v - 9.8 * 0.01) * kept;
      y += v * 0.01;
      if (y - lowest <= std::sqrt(4 - 0.09)) return n;
    }
  };
  EXPECT_EQ(touching_step(1), 46);
  EXPECT_EQ(touching_step(0.99), 46);
  EXPECT_EQ(first, 46);
}

TEST(Motion, EnergyNeverGrowsInAClosedBox) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  for (std::uint64_t run = 0; run < 6; ++run) {
    Random random(seed + run);
    Scene scene = test::thesis_scene();
    for (int i = 0; i < 60; ++i) {
      BodyDef def =
          test::ball(random.uniform_in_box({-4, -4, -4}, {4, 4, 4}), 1, random.uniform(1, 5));
      def.velocity = random.uniform_in_box({-9, -9, -9}, {9, 9, 9});
      def.angular_velocity = random.uniform_in_box({-9, -9, -9}, {9, 9, 9});
      def.friction = run < 3 ? random.uniform() : 0;
      def.restitution = run % 3 == 0 ? 1 : random.uniform();
      scene.bodies.push_back(def);
    }
    for (int axis = 0; axis < 3; ++axis) {
      for (const Real side : {Real(-1), Real(1)}) {
        Vec3 normal;
        normal[axis] = side;
        BodyDef wall = test::half_space(normal, -5);
        wall.restitution = 1;
        scene.bodies.push_back(wall);
      }
    }
    World world(scene);
    double energy = test::sums(world).energy;
    const double first = energy;
    for (int n = 0; n < 200; ++n) {
      world.step();
      const double now = test::sums(world).energy;
      ASSERT_LE(now, energy * (1 + 200 * static_cast<double>(kEpsilon))) << n;
      energy = now;
    }
    if (run == 3) {  // elastic and frictionless: only impacts slower than 0.25 m/s lose energy
      EXPECT_GT(energy, 0.97 * first);
    }
  }
}

// The original clamps the depth of every contact to the epsilon and then picks any of them.
TEST(Erratum, E06_the_deepest_contact_is_resolved_first) {
  Scene scene = test::thesis_scene();
  for (const Real overlap : {0.2_r, 0.5_r, 0.3_r}) {
    const Real y = 10 * static_cast<Real>(scene.bodies.size());
    scene.bodies.push_back(test::ball({0, y, 0}));
    scene.bodies.push_back(test::ball({2 - overlap, y, 0}));
  }
  scene.resolver.max_iterations = 2;
  World world(scene);
  const StepReport report = world.step();
  EXPECT_EQ(report.position_iterations, 2u);
  EXPECT_TRUE(report.iterations_exhausted);
  const std::vector<BodyState> s = world.states();
  const auto gap = [&](std::size_t i) { return s[2 * i + 1].position.x - s[2 * i].position.x; };
  EXPECT_EQ(gap(0), 2 - 0.2_r);  // the two deeper contacts have used the limit
  EXPECT_NEAR(gap(1), 2, 0.011);
  EXPECT_NEAR(gap(2), 2, 0.011);
}

TEST(Erratum, E06_a_ball_on_the_ground_does_not_sink) {
  Scene scene = test::thesis_scene();
  BodyDef ball = test::heavy({0, 1, 0});
  ball.can_sleep = false;
  scene.bodies = {ball, test::ground()};
  World world(scene);
  for (int n = 0; n < 600; ++n) world.step();
  EXPECT_GT(world.states()[0].position.y, 0.98_r);  // the original: 0.02 after 600 steps
}

TEST(Erratum, E07_coincident_centres_part_along_x_and_stay_finite) {
  Scene scene = test::thesis_scene();
  scene.bodies = {test::ball({5, 5, 5}), test::ball({5, 5, 5})};
  World world(scene);
  const StepReport report = world.step();
  EXPECT_EQ(report.sphere_contacts, 1u);
  EXPECT_FALSE(report.non_finite);
  const auto states = world.states();
  EXPECT_NEAR(states[0].position.x - states[1].position.x, 2, 0.0101);
  EXPECT_EQ(states[0].position.y, 5);
}

// The thesis prints 0.01^dt, its source uses 0.05^dt, Millington 0.5^dt.
TEST(Erratum, E55_the_bias_decides_how_soon_a_body_at_rest_sleeps) {
  for (const Real bias : {0.01_r, 0.05_r, 0.5_r}) {
    Scene scene = test::thesis_scene();
    scene.dt = 0.001_r;
    scene.sleep.bias = bias;
    scene.bodies = {test::ball({})};
    scene.bodies[0].can_sleep = true;
    World world(scene);
    int steps = 0;
    for (; world.awake(world.bodies()[0]) && steps < 5000; ++steps) world.step();
    // From 2 epsilon to epsilon: bias^t = 1/2.
    EXPECT_NEAR(steps * 0.001, std::log(0.5) / std::log(static_cast<double>(bias)), 0.002) << bias;
  }
}

}  // namespace
}  // namespace jfpx
