/// Rebounds, conserved quantities, and bodies that are faster than their size per step.
#include "tests/world/quality.hpp"

#include <gtest/gtest.h>

#include <array>

namespace jfpx {
namespace {

using test::operator""_r;
using test::kGravity;

/// [m], height of the first rebound of a ball that falls from `height` above the second body.
double rebound(BodyDef target, double restitution, double height, double dt) {
  BodyDef ball = test::heavy_ball({0.013_r, static_cast<Real>(0.5 + height), 0}, 0.5_r);
  ball.restitution = target.restitution = static_cast<Real>(restitution);
  ball.friction = target.friction = 0;
  Scene scene;
  scene.dt = static_cast<Real>(dt);
  scene.bodies = {ball, target};
  World world(test::awake(scene));
  bool has_hit = false;
  for (int n = 0; n < 10000; ++n) {
    world.step();
    const auto v = static_cast<double>(world.states()[0].velocity.y);
    has_hit = has_hit || v > 0;
    // The highest point, from the height and the velocity after a step.
    if (has_hit) {
      return static_cast<double>(world.states()[0].position.y) - 0.5 + v * v / (2 * kGravity);
    }
  }
  return -1;
}

TEST(Impacts, ABallReboundsToTheSquareOfTheRestitution) {
  BodyDef floor = test::crate({0, -1, 0}, {10, 1, 10}, 0);
  BodyDef sphere = test::heavy_ball({0.013_r, -1, 0}, 1, 0);
  for (const BodyDef& target : {test::ground(), floor, sphere}) {
    for (const double e : {0.2, 0.5, 0.8, 1.0}) {
      for (const double height : {1.0, 2.3, 5.0}) {
        for (const double dt : {1 / 60.0, 1 / 120.0, 1 / 240.0}) {
          const double expected = e * e * height;
          EXPECT_NEAR(rebound(target, e, height, dt), expected, 0.03 * expected)
              << "e " << e << ", height " << height << ", dt " << dt << ", shape "
              << target.shape.index();
        }
      }
    }
  }
}

TEST(Impacts, AGasWithoutFrictionKeepsItsEnergy) {
  Scene scene = scenes::make("gas", {.spheres = 27});
  for (BodyDef& body : scene.bodies) body.restitution = 1;
  scene.soft_step.restitution_threshold = 0;
  World world(test::awake(scene));
  const auto energy = [&world] {
    double sum = 0;
    for (const BodyState& body : world.states()) {
      sum += static_cast<double>(length_squared(body.velocity));
    }
    return sum;
  };
  const double before = energy();
  for (int n = 0; n < 10000; ++n) {
    world.step();
    ASSERT_LE(energy(), 1.01 * before) << n;
  }
  EXPECT_GE(energy(), 0.95 * before);
}

TEST(Impacts, APushedRowOfBallsPassesTheVelocityOn) {
  // Solved in different orders, because colors depend on the indices.
  for (const std::array<int, 5>& places :
       {std::array{0, 1, 2, 3, 4}, {4, 3, 2, 1, 0}, {2, 0, 4, 1, 3}}) {
    for (const Real speed : {1.0_r, 4.0_r}) {
      Scene scene;
      for (const int place : places) {
        BodyDef ball = test::ball({place == 0 ? -1 : static_cast<Real>(place), 0, 0}, 0.5_r);
        ball.restitution = 1;
        if (place == 0) ball.velocity.x = speed;
        scene.bodies.push_back(ball);
      }
      World world(test::awake(scene));
      while (world.time() < 2) world.step();
      for (std::size_t i = 0; i < places.size(); ++i) {
        const double expected = places[i] == 4 ? static_cast<double>(speed) : 0;
        EXPECT_NEAR(static_cast<double>(world.states()[i].velocity.x), expected, 1e-3)
            << "place " << places[i] << " of body " << i << ", speed " << speed;
      }
    }
  }
}

TEST(Impacts, AHeavyBallThatFallsOnALightOneComesToRestOnIt) {
  for (const Real mass : {10.0_r, 100.0_r}) {
    Scene scene;
    scene.bodies = {test::ground(), test::heavy_ball({0, 0.5_r, 0}, 0.5_r),
                    test::heavy_ball({0, 2.5_r, 0}, 0.5_r, mass)};
    for (BodyDef& body : scene.bodies) body.restitution = 0.3_r;
    World world(test::awake(scene));
    test::run(&world, 5);
    EXPECT_NEAR(static_cast<double>(world.states()[1].position.y), 0.5, 0.01) << mass;
    EXPECT_NEAR(static_cast<double>(world.states()[2].position.y), 1.5, 0.03) << mass;
    EXPECT_LT(test::speeds(world).largest, 0.05) << mass;
  }
}

TEST(Impacts, ABoxThatFallsFlatOnABoxDoesNotTip) {
  // Detected at any distance up to that of a step, some of them within the speculative margin.
  for (int k = 0; k < 40; ++k) {
    Scene scene;
    const Real height = 1 + 0.004_r * static_cast<Real>(k);
    scene.bodies = {test::ground(), test::crate({0, 0.5_r, 0}, {0.5_r, 0.5_r, 0.5_r}),
                    test::crate({0.1_r, 1.5_r + height, 0}, {0.5_r, 0.5_r, 0.5_r})};
    World world(test::awake(scene));
    while (world.time() < 1) {
      world.step();
      ASSERT_LE(test::penetration(world).largest, 0.03) << height;
      ASSERT_LE(length(world.states()[2].angular_velocity), 1) << height;
    }
  }
}

TEST(Impacts, ABoxReboundsToTheSquareOfTheRestitutionAlsoFromASmallerOne) {
  for (const Real e : {1._r, 0.5_r}) {
    for (const Real half_extent : {0.5_r, 0.2_r}) {
      Scene scene;
      const Vec3 size{half_extent, half_extent, half_extent};
      BodyDef below = test::crate({0, -half_extent, 0}, size, 0);
      BodyDef box = test::crate({0.05_r, 2.5_r, 0}, {0.5_r, 0.5_r, 0.5_r});
      below.restitution = box.restitution = e;
      scene.bodies = {below, box};
      World world(test::awake(scene));
      Real highest = 0;
      bool has_rebounded = false;
      while (world.time() < 2) {
        world.step();
        const BodyState state = world.states()[1];
        has_rebounded |= state.velocity.y > 0;
        if (has_rebounded) highest = std::max(highest, state.position.y - 0.5_r);
      }
      const auto expected = static_cast<double>(2 * e * e);
      EXPECT_NEAR(static_cast<double>(highest), expected, 0.01 * expected)
          << e << ", " << half_extent;
    }
  }
}

TEST(Impacts, CollisionsConserveTheMomentum) {
  for (const bool is_box : {false, true}) {
    const std::uint64_t seed = test::fresh_seed();
    SCOPED_TRACE(test::trace(seed));
    Random random(seed);
    Scene scene;
    for (int i = 0; i < 64; ++i) {
      const Vec3 position =
          Vec3{static_cast<Real>(i % 4), static_cast<Real>(i / 4 % 4), static_cast<Real>(i / 16)} *
              1.3_r -
          Vec3{2, 2, 2};
      const Real mass = random.uniform(1, 2);
      BodyDef body = test::heavy_ball(position, 0.5_r, mass);
      if (is_box) body.shape = Box{{0.4_r, 0.3_r, 0.45_r}};
      body.velocity = random.uniform_in_box({-1, -1, -1}, {1, 1, 1}) - position;
      body.angular_velocity = random.uniform_in_box({-2, -2, -2}, {2, 2, 2});
      body.acceleration = {};
      body.restitution = 0.5_r;
      scene.bodies.push_back(body);
    }
    World world(test::awake(scene));
    const auto momentum = [&world, &scene] {
      Vec3 sum;
      const std::vector<BodyState> states = world.states();
      for (std::size_t i = 0; i < states.size(); ++i) {
        sum += states[i].velocity * scene.bodies[i].mass;
      }
      return sum;
    };
    const Vec3 before = momentum();
    test::run(&world, 4);
    // 96 kg at 2 m/s, and some thousand impulses.
    EXPECT_LT(static_cast<double>(length(momentum() - before)),
              static_cast<double>(2000 * kEpsilon));
  }
}

/// Shoots a body along z at a wall around z = 0, from 40 distances.
void expect_that_it_stops(BodyDef body, Real speed, Real half_thickness) {
  for (int k = 0; k < 40; ++k) {
    body.position = {0.1_r, 0.2_r, -5 - 0.0713_r * static_cast<Real>(k)};
    body.velocity.z = speed;
    body.acceleration = {};
    Scene scene;
    scene.bodies = {body, test::crate({}, {2, 2, half_thickness}, 0)};
    World world(test::awake(scene));
    for (int n = 0; n < 30; ++n) world.step();
    EXPECT_LT(world.states()[0].position.z, 0) << k;
  }
}

TEST(Impacts, AWallOf1CmStopsABallAt200MetresPerSecond) {
  BodyDef ball = test::heavy_ball({}, 0.1_r);
  expect_that_it_stops(ball, 200, 0.005_r);
  ball.velocity = {5, 3, 0};
  expect_that_it_stops(ball, 200, 0.005_r);
}
TEST(Impacts, AWallOf1CmStopsABoxAt200MetresPerSecond) {
  expect_that_it_stops(test::crate({}, {0.1_r, 0.1_r, 0.1_r}), 200, 0.005_r);
}
TEST(Impacts, AWallOf20CmStopsABallAt300MetresPerSecond) {
  expect_that_it_stops(test::heavy_ball({}, 0.1_r), 300, 0.1_r);
}

TEST(Impacts, AFastBallThatPassesBesideABallIsNotDeflected) {
  for (const bool is_box : {false, true}) {
    BodyDef fast = test::heavy_ball({0, 0.31_r, -3}, 0.1_r), other = test::heavy_ball({}, 0.2_r);
    if (is_box) fast.shape = Box{{0.1_r, 0.1_r, 0.1_r}}, other.shape = Box{{0.2_r, 0.2_r, 0.2_r}};
    fast.velocity = {0, 0, 200};
    fast.acceleration = other.acceleration = {};
    Scene scene;
    scene.bodies = {fast, other};
    World world(test::awake(scene));
    for (int n = 0; n < 10; ++n) world.step();
    EXPECT_EQ(world.states()[0].velocity, fast.velocity);
    EXPECT_EQ(world.states()[1].velocity, other.velocity);
  }
}

TEST(Impacts, AnElasticHeadOnCollisionExchangesTheVelocities) {
  Scene scene;
  scene.bodies = {test::ball({0, 0, -3}, 0.1_r), test::ball({}, 0.2_r)};
  for (BodyDef& body : scene.bodies) body.restitution = 1;
  scene.bodies[0].velocity = {0, 0, 200};
  World world(scene);
  for (int n = 0; n < 10; ++n) world.step();
  EXPECT_NEAR(static_cast<double>(world.states()[0].velocity.z), 0, 1e-3);
  EXPECT_NEAR(static_cast<double>(world.states()[1].velocity.z), 200, 1e-3);
}

}  // namespace
}  // namespace jfpx
