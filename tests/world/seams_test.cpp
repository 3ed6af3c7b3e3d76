/// Bodies on flush boxes, hulls and parts of compounds: seams stop nothing, steps and walls do.
#include "tests/world/sliders.hpp"
#include "tests/world/tiles.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace jfpx {
namespace {

using test::Slider;
using test::tiled_floor;
using test::Tiles;
using test::operator""_r;

BodyDef rolling_ball(const Vec3& position, Real radius, Real speed) {
  BodyDef body = test::ball(position, radius);
  body.velocity = {speed, 0, 0};
  body.angular_velocity = {0, 0, -speed / radius};
  body.friction = 0.8_r;
  body.restitution = 0;
  body.acceleration = {0, -9.81_r, 0};
  return body;
}

class Seams : public ::testing::TestWithParam<Tiles> {};
INSTANTIATE_TEST_SUITE_P(Of, Seams, ::testing::Values(Tiles::boxes, Tiles::hulls, Tiles::parts),
                         [](const auto& kind) { return test::name_of(kind.param); });

TEST_P(Seams, StopNothingThatSlides) {
  const Real half_turn = square_root(0.5_r);
  const Slider sliders[] = {
      {"ball", Sphere{0.5_r}, 0.5_r},
      {"box", Box{{0.5_r, 0.4_r, 0.3_r}}, 0.4_r},
      {"hull", test::hull_of({{0.3_r, 0.4_r, 0.6_r}}), 0.4_r},
      {"capsule", Capsule{0.25_r, 0.5_r}, 0.25_r, {half_turn, 0, 0, half_turn}}};
  const std::vector<BodyDef> floor = tiled_floor(GetParam(), 44, 0);
  for (const Slider& slider : sliders) test::expect_to_slide(slider, floor, 0.001_r);
}

TEST_P(Seams, StopNothingThatRolls) {
  for (const Real speed : {0.3_r, 1.0_r, 5.0_r, 10.0_r}) {
    SCOPED_TRACE("speed " + std::to_string(speed));
    Scene scene;
    scene.bodies = tiled_floor(GetParam(), 42, 0.8_r);
    scene.bodies.push_back(rolling_ball({-20, 0.3_r, 0.2_r}, 0.3_r, speed));
    World world(scene);
    Real change = 0;
    const BodyId ball = world.bodies().back();
    const int steps = static_cast<int>(2400 / std::max(speed, 2.0_r));
    for (int n = 0; n < steps; ++n) {
      world.step();
      change = std::max(change, absolute(world.state(ball).position.y - 0.3_r));
    }
    EXPECT_LT(change, 0.001_r);
    EXPECT_NEAR(world.state(ball).velocity.x, speed, 0.01_r * speed);
    EXPECT_NEAR(world.state(ball).velocity.z, 0, 0.001_r * speed);
  }
}

/// The tiles are parts of a heavy body that can move.
TEST(SeamsOfAMovableBody, StopNothingThatRolls) {
  Scene scene;
  scene.sleep.enabled = false;
  scene.bodies.push_back(test::fixed_surface(HalfSpace{{0, 1, 0}, -1}, 0.8_r));
  BodyDef plate = tiled_floor(Tiles::parts, 22, 0.8_r).front();
  plate.shape = centred(std::get<Compound>(plate.shape));
  plate.position = {0, -0.5_r, 0};
  plate.mass = 1e5_r;
  plate.acceleration = {0, -9.81_r, 0};
  scene.bodies.push_back(plate);
  scene.bodies.push_back(rolling_ball({-10, 0.3_r, 0.2_r}, 0.3_r, 5));
  World world(scene);
  const BodyId ball = world.bodies().back();
  for (int n = 0; n < 240; ++n) world.step();
  EXPECT_NEAR(world.state(ball).velocity.x, 5, 0.05_r);
  EXPECT_NEAR(world.state(ball).position.y, 0.3_r, 0.002_r);
}

/// A tile that stands out by 0.2 m is no seam.
TEST_P(Seams, DifferFromSteps) {
  Scene scene;
  scene.bodies = tiled_floor(GetParam(), 12, 0);
  BodyDef step = test::fixed_surface(Box{{0.5_r, 0.5_r, 6}}, 0);
  step.position = {2.5_r, -0.3_r, 0};
  scene.bodies.push_back(step);
  scene.bodies.push_back(rolling_ball({-4, 0.3_r, 0.2_r}, 0.3_r, 3));
  World world(scene);
  Real farthest = -10;
  for (int n = 0; n < 240; ++n) {
    world.step();
    farthest = std::max(farthest, world.state(world.bodies().back()).position.x);
  }
  EXPECT_NEAR(farthest, 2 - square_root(0.3_r * 0.3_r - 0.1_r * 0.1_r), 0.05_r);
}

/// In a concave corner of flush solids, floor and walls have all their contacts.
TEST_P(Seams, DifferFromConcaveCorners) {
  for (const Shape& shape : {Shape(Box{{0.3_r, 0.3_r, 0.3_r}}), Shape(Sphere{0.3_r})}) {
    Scene scene;
    scene.bodies = tiled_floor(GetParam(), 12, 0);
    const Vec3 walls[] = {{3.5_r, 0.5_r, 0}, {0, 0.5_r, 3.5_r}};
    for (const Vec3& position : walls) {
      const bool along_z = position.x != 0;
      BodyDef wall =
          test::fixed_surface(Box{along_z ? Vec3{0.5_r, 1.5_r, 6} : Vec3{6, 1.5_r, 0.5_r}}, 0);
      wall.position = position;
      scene.bodies.push_back(wall);
    }
    BodyDef body = test::ball({0.5_r, 0.3_r, 0.5_r});
    body.shape = shape;
    body.restitution = 0;
    body.velocity = {3, 0, 2};
    body.acceleration = {8, -9.81_r, 6};
    scene.bodies.push_back(body);
    World world(scene);
    for (int n = 0; n < 300; ++n) world.step();
    const BodyState state = world.state(world.bodies().back());
    EXPECT_NEAR(state.position.x, 2.7_r, 0.005_r);
    EXPECT_NEAR(state.position.y, 0.3_r, 0.005_r);
    EXPECT_NEAR(state.position.z, 2.7_r, 0.005_r);
    EXPECT_LT(length(state.velocity), 0.01_r);
  }
}

}  // namespace
}  // namespace jfpx
