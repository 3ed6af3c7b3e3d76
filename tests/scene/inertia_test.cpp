/// Tests of bodies with a given inertia, and of quantities that are derived from a body's state.
#include <jfpx/error.hpp>

#include "src/collide/shapes.hpp"
#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace jfpx {
namespace {

using test::operator""_r;

JFPX_SOFT_STEP_SUITE(Inertia);
JFPX_SOFT_STEP_SUITE(DerivedData);

BodyDef spinning(const std::optional<Mat3>& inertia) {
  BodyDef def = test::ball({0, 0, 0});
  def.inertia = inertia;
  def.angular_velocity = {0.3_r, 2, -0.5_r};
  return def;
}
World world_of(const BodyDef& def, Real dt = 0.001_r) {
  Scene scene = test::empty_scene();
  scene.dt = dt;
  scene.bodies = {def};
  return World(scene);
}

TEST_P(Inertia, OfABoxMakesABallRotateAsABox) {
  BodyDef box = spinning({});
  box.shape = Box{{0.5_r, 1, 1.5_r}};
  World as_box = world_of(box);
  const Vec3 moments = detail::moments_of_inertia(std::get<Box>(box.shape), 1);
  World as_ball = world_of(spinning(diagonal(moments)));
  for (int n = 0; n < 1000; ++n) as_box.step(), as_ball.step();
  EXPECT_EQ(as_ball.states(), as_box.states());
}

TEST_P(Inertia, InRotatedAxesEqualsThatOfARotatedBody) {
  // A body in the identity orientation whose tensor is rotated by q moves as the body with
  // principal axes whose orientation is q.
  const Quat q = normalized(Quat{0.7_r, 0.1_r, -0.5_r, 0.4_r});
  const Mat3 r = to_matrix(q), principal = diagonal({1, 2, 2.5_r});
  World rotated_tensor = world_of(spinning(r * principal * transposed(r)));
  BodyDef rotated_body = spinning(principal);
  rotated_body.orientation = q;
  World rotated = world_of(rotated_body);
  for (int n = 0; n < 2000; ++n) {
    rotated_tensor.step();
    rotated.step();
    const Vec3 a = rotated_tensor.states()[0].angular_velocity;
    const Vec3 b = rotated.states()[0].angular_velocity;
    for (int k = 0; k < 3; ++k) ASSERT_NEAR(a[k], b[k], 2e-3) << n;
  }
  // The body tumbles: its axis of rotation has changed.
  EXPECT_GT(length(rotated.states()[0].angular_velocity - Vec3{0.3_r, 2, -0.5_r}), 0.3_r);
}

TEST_P(Inertia, FreeRotationKeepsTheAngularMomentumAndGainsNoEnergy) {
  const Mat3 tensor{{{2, 0.5_r, -0.3_r}, {0.5_r, 1.5_r, 0.2_r}, {-0.3_r, 0.2_r, 2.5_r}}};
  World world = world_of(spinning(tensor), 0.0005_r);
  const auto momentum = [&] {
    const BodyState s = world.states()[0];
    return detail::in_world_axes(tensor, to_matrix(s.orientation)) * s.angular_velocity;
  };
  const auto energy = [&] { return dot(world.states()[0].angular_velocity, momentum()) / 2; };
  const Vec3 l0 = momentum();
  const Real e0 = energy();
  for (int n = 0; n < 4000; ++n) world.step();
  EXPECT_LT(length(momentum() - l0), 5e-3_r * length(l0));
  EXPECT_LE(energy(), e0 * 1.0001_r);
  EXPECT_GE(energy(), e0 * 0.99_r);
}

TEST_P(Inertia, ATorqueAcceleratesByTheInverseTensor) {
  // Inverse of ((2, 1, 0), (1, 2, 0), (0, 0, 3)): ((2, -1, 0), (-1, 2, 0), (0, 0, 1)) / 3.
  BodyDef def = spinning(Mat3{{{2, 1, 0}, {1, 2, 0}, {0, 0, 3}}});
  def.angular_velocity = {};
  World world = world_of(def);
  world.apply_torque(world.bodies()[0], {3, 0, 6});
  world.step();
  const Vec3 w = world.states()[0].angular_velocity;
  EXPECT_NEAR(w.x, 0.002, 1e-7);
  EXPECT_NEAR(w.y, -0.001, 1e-7);
  EXPECT_NEAR(w.z, 0.002, 1e-7);
  EXPECT_NEAR(world.inverse_inertia(world.bodies()[0])(0, 1), -1.0 / 3, 1e-6);
}

TEST_P(Inertia, OfABodyWithoutMassIsIgnored) {
  BodyDef def = spinning(Mat3{});
  def.mass = 0;
  World world = world_of(def);
  world.apply_torque(world.bodies()[0], {1, 1, 1});
  world.step();
  EXPECT_EQ(world.states()[0], BodyState{});
  EXPECT_EQ(world.inverse_inertia(world.bodies()[0]), diagonal({0, 0, 0}));
  EXPECT_EQ(world.mass(world.bodies()[0]), 0);
}

TEST_P(DerivedData, PointsAndDirectionsGoToTheWorldAndBack) {
  // A quarter turn about z maps x to y.
  const BodyState body{{10, 20, 30}, normalized(Quat{1, 0, 0, 1}), {}, {}};
  const Vec3 point = to_world_point(body, {1, 2, 3});
  EXPECT_NEAR(point.x, 8, 1e-5);
  EXPECT_NEAR(point.y, 21, 1e-5);
  EXPECT_NEAR(point.z, 33, 1e-5);
  EXPECT_NEAR(to_world_direction(body, {1, 0, 0}).y, 1, 1e-6);

  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  const auto any = [&random] { return random.uniform_in_box({-5, -5, -5}, {5, 5, 5}); };
  for (int i = 0; i < 1000; ++i) {
    const Vec3 v = any(), p = any();
    const BodyState s{any(), normalized(Quat{random.uniform(-1, 1), v.x, v.y, v.z}), any(), any()};
    ASSERT_LT(length(to_local_point(s, to_world_point(s, p)) - p), 100 * kEpsilon);
    ASSERT_LT(length(to_local_direction(s, to_world_direction(s, p)) - p), 100 * kEpsilon);
  }
}

TEST_P(DerivedData, VelocityAtAPointIsItsRateOfChange) {
  BodyDef def = spinning({});
  def.velocity = {1, -2, 3};
  World world = world_of(def, 1e-3_r);
  const BodyState before = world.states()[0];
  const Vec3 local{0.2_r, 0.5_r, -0.4_r};
  const Vec3 from = to_world_point(before, local);
  world.step();
  const Vec3 moved = to_world_point(world.states()[0], local) - from;
  const Vec3 expected = velocity_at(before, from) * 1e-3_r;
  EXPECT_LT(length(moved - expected), 1e-5_r);
  EXPECT_EQ(velocity_at(before, before.position), def.velocity);
}

TEST_P(DerivedData, OfAnInvalidBodyIdIsAnError) {
  World world = world_of(spinning({}));
  EXPECT_THROW(world.mass(BodyId{}), InvalidArgument);
  EXPECT_THROW(world.inverse_inertia(BodyId{}), InvalidArgument);
}

}  // namespace
}  // namespace jfpx
