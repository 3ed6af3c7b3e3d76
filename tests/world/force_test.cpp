/// Tests of forces against analytic mechanics: springs, drag, wings, buoyancy, explosions.
#include "tests/world/force_support.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace jfpx {
namespace {

using test::operator""_r;
using test::ball_at;
using test::BuoyancyForce;
using test::Erratum;
using test::expect_near;
using test::kEps;
using test::kPiD;
using test::world_of;

JFPX_INSTANTIATE_SOFT_STEP(Erratum);
JFPX_INSTANTIATE_SOFT_STEP(BuoyancyForce);
JFPX_SOFT_STEP_SUITE(SpringForce);
JFPX_SOFT_STEP_SUITE(BungeeForce);
JFPX_SOFT_STEP_SUITE(DragForce);
JFPX_SOFT_STEP_SUITE(AeroForce);
JFPX_SOFT_STEP_SUITE(AeroControlForce);
JFPX_SOFT_STEP_SUITE(ExplosionForce);

TEST_P(Erratum, E21_a_compressed_spring_pushes) {
  World world = world_of({ball_at({0, 3, 0}), ball_at({0, 5, 0})});
  const BodyId a = world.bodies()[0], b = world.bodies()[1];
  world.add_force(Spring{.a = {a}, .b = {b}, .stiffness = 4, .rest_length = 5});
  world.step();
  expect_near(world.last_acceleration(a), {0, -6, 0}, 1e-5);  // 4 N/m * 3 m / 2 kg, downwards
  expect_near(world.last_acceleration(b), {0, 6, 0}, 1e-5);
}

// Solver::soft_step has forces that are constant in a step of several substeps, which adds energy
// to a spring.
TEST(SpringForce, SwingsWithItsPeriodAndKeepsItsEnergy) {
  // omega = sqrt(8/2) = 2; semi-implicit Euler swings with cos(W dt) = 1 - (omega dt)^2 / 2.
  const double dt = 1.0 / 128, omega = 2, amplitude = 3;
  World world = world_of({ball_at({5 + 3, 0, 0})}, 1.0_r / 128, Solver::worst_first);
  const BodyId id = world.bodies()[0];
  world.add_force(Spring{.a = {id}, .stiffness = 8, .rest_length = 5});
  const double step = std::acos(1 - omega * omega * dt * dt / 2);
  // x_0 = A and x_1 = A (1 - (omega dt)^2) fix the phase: x_n = A cos(n W + p) / cos(p).
  const double phase = std::atan((std::cos(step) - (1 - omega * omega * dt * dt)) / std::sin(step));
  for (int n = 1; n <= 40000; ++n) {
    world.step();
    const double x = static_cast<double>(world.state(id).position.x) - 5;
    const double v = world.state(id).velocity.x;
    ASSERT_NEAR(x, amplitude * std::cos(n * step + phase) / std::cos(phase),
                1e4 * kEps * (1 + 0.01 * n))
        << n;
    // The energy of the method oscillates by omega dt / 2 around a constant and stays bounded.
    ASSERT_NEAR(v * v + 4 * x * x, 36, 36 * (omega * dt / 2 + 1e-3));
  }
  // Two frequencies, hence two periods: dt^2/24 apart, relative to the period.
  EXPECT_NEAR(step / dt, omega, omega * std::pow(omega * dt, 2) / 23);
}

TEST_P(SpringForce, BetweenTwoBodiesKeepsBothMomenta) {
  BodyDef a = ball_at({-3, 0, 0}, {1, 2, 3}), b = ball_at({3, 1, 0}, {0, -1, 2});
  b.mass = 7;
  World world = world_of({a, b}, 0.001_r);
  world.add_force(Spring{.a = {world.bodies()[0], {0.5_r, 0.5_r, 0}},
                         .b = {world.bodies()[1], {-0.5_r, 0, 0.3_r}},
                         .stiffness = 10,
                         .damping = 0.5_r,
                         .rest_length = 4});
  const test::Sums before = test::sums(world);
  for (int n = 0; n < 1000; ++n) world.step();
  const test::Sums after = test::sums(world);
  EXPECT_NE(world.states()[0].angular_velocity, Vec3{});
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(after.momentum[k], before.momentum[k], 100 * kEps * before.scale);
    EXPECT_NEAR(after.angular_momentum[k], before.angular_momentum[k], 1000 * kEps * before.scale);
  }
}

TEST_P(SpringForce, DampingTakesTheEnergyOut) {
  World world = world_of({ball_at({8, 0, 0})});
  world.add_force(Spring{.a = {world.bodies()[0]}, .stiffness = 8, .damping = 4, .rest_length = 5});
  for (int n = 0; n < 2000; ++n) world.step();  // e^(-damping t / 2m) = e^-20
  expect_near(world.states()[0].position, {5, 0, 0},
              1e-4);  // float stops where v dt is half an ulp of x
  expect_near(world.states()[0].velocity, {0, 0, 0}, 1e-4);
}

TEST_P(SpringForce, WithoutAnyLengthHasNoDirection) {
  World world = world_of({ball_at({0, 0, 0})});
  world.add_force(Spring{.a = {world.bodies()[0]}, .stiffness = 8, .rest_length = 5});
  EXPECT_FALSE(world.step().non_finite);
  EXPECT_EQ(world.states()[0], BodyState{});
}

TEST_P(BungeeForce, HangsSlackAndOnlyPulls) {
  World world = world_of({ball_at({4, 0, 0}, {-1, 0, 0}), ball_at({-6, 3, 0})});
  const BodyId a = world.bodies()[0], b = world.bodies()[1];
  world.add_force(Bungee{.a = {a}, .stiffness = 8, .rest_length = 5});
  world.add_force(Bungee{.a = {b}, .b = {{}, {0, 3, 0}}, .stiffness = 8, .rest_length = 5});
  world.step();
  EXPECT_EQ(world.last_acceleration(a), Vec3{});             // 1 m of slack
  expect_near(world.last_acceleration(b), {4, 0, 0}, 1e-5);  // 1 m too long: 8 N / 2 kg
}

TEST_P(BungeeForce, ItsDampingDoesNotPush) {
  World world = world_of({ball_at({5.1_r, 0, 0}, {-9, 0, 0})});
  world.add_force(
      Bungee{.a = {world.bodies()[0]}, .stiffness = 8, .damping = 100, .rest_length = 5});
  world.step();
  EXPECT_EQ(world.last_acceleration(world.bodies()[0]), Vec3{});
}

TEST_P(DragForce, LinearDragFollowsTheGeometricSum) {
  // v_{n+1} = v_n (1 - k dt/m) + g dt  =>  v_n = v_0 q^n + g dt (1 - q^n)/(1 - q)
  World world = world_of({ball_at({0, 0, 0}, {30, 40, 0})});
  world.add_force(Gravity{});
  world.add_force(Drag{.linear = 0.6_r});
  const double q = 1 - 0.6 * 0.01 / 2;
  double x = 0;
  for (int n = 1; n <= 300; ++n) {
    world.step();
    x += 0.01 * 30 * std::pow(q, n);
  }
  const double qn = std::pow(q, 300);
  const BodyState s = world.states()[0];
  EXPECT_NEAR(s.velocity.x, 30 * qn, 2000 * kEps);
  EXPECT_NEAR(s.velocity.y, 40 * qn - 9.81 * 0.01 * (1 - qn) / (1 - q), 2000 * kEps);
  EXPECT_NEAR(s.position.x, x, 1e4 * kEps);
}

TEST_P(DragForce, AFallWithQuadraticDragEndsAtTheTerminalVelocity) {
  World world = world_of({ball_at({0, 0, 0})});
  world.add_force(Gravity{});
  world.add_force(Drag{.quadratic = 0.1_r, .wind = {3, 0, 0}});
  for (int n = 0; n < 3000; ++n) world.step();
  // m g = k v^2; the wind carries the ball along.
  expect_near(world.states()[0].velocity, {3, static_cast<Real>(-std::sqrt(2 * 9.81 / 0.1)), 0},
              1e-3);
}

TEST_P(AeroForce, LiftPointsUpWhenFlyingForwards) {
  // The wing of the thesis' aircraft, which flies towards -x: yx -1, yy -0.5.
  Mat3 tensor = diagonal({0, -0.5_r, 0});
  tensor(1, 0) = -1;
  World world = world_of({ball_at({0, 0, 0}, {-10, 0, 0})});
  const BodyId id = world.bodies()[0];
  world.add_force(Aero{.body = id, .tensor = tensor});
  world.step();
  expect_near(world.last_acceleration(id), {0, 5, 0}, 1e-6);  // -1 * -10 / 2 kg
}

TEST_P(AeroForce, UsesBodyAxes) {
  Mat3 tensor = diagonal({});
  tensor(1, 0) = -1;
  const Real half = square_root(0.5_r);
  BodyDef def = ball_at({0, 0, 0}, {0, -10, 0});
  def.orientation = {half, 0, 0, half};  // body x is world y, body y is world -x
  World world = world_of({def});
  const BodyId id = world.bodies()[0];
  world.add_force(Aero{.body = id, .tensor = tensor});
  world.step();
  expect_near(world.last_acceleration(id), {-5, 0, 0}, 1e-5);
}

TEST_P(Erratum, E27_drifting_with_the_wind_feels_no_air) {
  World world = world_of({ball_at({0, 0, 0}, {3, 4, 5})});
  const BodyId id = world.bodies()[0];
  world.add_force(Aero{.body = id, .tensor = diagonal({-1, -1, -1}), .wind = {3, 4, 5}});
  world.step();
  EXPECT_EQ(world.last_acceleration(id), Vec3{});
  world.force<Aero>(world.forces()[0]).wind = {3, 4,
                                               7};  // now from behind, in the direction of motion
  world.step();
  expect_near(world.last_acceleration(id), {0, 0, 1}, 1e-6);
}

TEST_P(Erratum, E27_wings_damp_rolling) {
  BodyDef def = ball_at({0, 0, 0});
  def.angular_velocity = {2, 0, 0};
  World world = world_of({def});
  const BodyId id = world.bodies()[0];
  for (const Real side : {Real(-2), Real(2)}) {
    world.add_force(Aero{.body = id, .tensor = diagonal({0, -0.5_r, 0}), .point = {0, 0, side}});
  }
  world.step();
  // Each wing moves at 4 m/s; its force is 2 N on an arm of 2 m: 8 N m in all, with I = 0.8.
  expect_near(world.state(id).angular_velocity, {2 - 0.1_r, 0, 0}, 1e-6);
  EXPECT_EQ(world.last_acceleration(id), Vec3{});
}

TEST_P(AeroControlForce, SteersBetweenItsTensors) {
  const AeroControl rudder{
      .lowest = diagonal({1, 0, 0}), .base = diagonal({2, 0, 0}), .highest = diagonal({6, 0, 0})};
  const std::pair<Real, Real> cases[] = {{-9.0_r, 1.0_r}, {-1.0_r, 1.0_r}, {-0.5_r, 1.5_r},
                                         {0.0_r, 2.0_r},  {0.25_r, 3.0_r}, {1.0_r, 6.0_r},
                                         {7.0_r, 6.0_r}};
  for (const auto& [control, expected] : cases) {
    AeroControl steered = rudder;
    steered.control = control;
    EXPECT_EQ(steered.tensor()(0, 0), expected) << control;
  }
}

TEST_P(AeroControlForce, WingsOfTheThesisRollTheAircraft) {
  // D of the thesis: left wing down, right wing up. Flying towards -x, the right wing (z = 2) then
  // lifts more: torque about x is -z * F_y < 0.
  const auto lift = [](Real yx) {
    Mat3 t = diagonal({0, -0.5_r, 0});
    t(1, 0) = yx;
    return t;
  };
  World world = world_of({ball_at({0, 0, 0}, {-10, 0, 0})});
  const BodyId id = world.bodies()[0];
  ForceId wings[2];
  for (const int side : {0, 1}) {
    wings[side] = world.add_force(AeroControl{.body = id,
                                              .lowest = lift(-0.995_r),
                                              .base = lift(-1),
                                              .highest = lift(-1.005_r),
                                              .point = {-1, 0, side == 0 ? Real(-2) : Real(2)}});
  }
  world.force<AeroControl>(wings[0]).control = -1;
  world.force<AeroControl>(wings[1]).control = 1;
  world.step();
  // 9.95 N at z = -2 and 10.05 N at z = 2: -0.2 N m about x; 20 N at x = -1: -20 N m about z.
  expect_near(world.state(id).angular_velocity, {-0.0025_r, 0, -0.25_r}, 1e-5);
  expect_near(world.last_acceleration(id), {0, 10, 0}, 1e-5);
}

TEST_P(BuoyancyForce, IsTheWeightOfTheDisplacedLiquid) {
  struct Case {
    Real height;
    double volume;
  };
  // Radius 1, density 3, gravity 10, mass 2; a cap of depth h has pi h^2 (3 - h) / 3.
  const Case cases[] = {{1.5_r, 0},
                        {1.0_r, 0},
                        {0.5_r, kPiD * 0.25 * 2.5 / 3},
                        {0.0_r, kPiD * 2 / 3},
                        {-0.5_r, kPiD * 2.25 * 1.5 / 3},
                        {-1.0_r, kPiD * 4 / 3},
                        {-70.0_r, kPiD * 4 / 3}};
  for (const Case& c : cases) {
    World world = world_of({ball_at({5, 7 + c.height, 3})});
    world.add_force(Buoyancy{.liquid = {{0, 1, 0}, 7}, .density = 3, .gravity = 10});
    world.step();
    expect_near(world.last_acceleration(world.bodies()[0]),
                {0, static_cast<Real>(c.volume * 3 * 10 / 2), 0}, 1e-4);
  }
}

TEST_P(BuoyancyForce, AFloatingBallBobsWithItsPeriod) {
  // Half the density of the liquid: it floats with its centre at the surface. The restoring force
  // per metre is density g pi r^2, so omega^2 = 3 g / (2 r) for small swings.
  BodyDef def = ball_at({0, 0.01_r, 0});
  def.mass = static_cast<Real>(500 * kPiD * 4 / 3);
  World world = world_of({def}, 0.001_r);
  world.add_force(Gravity{});
  world.add_force(Buoyancy{});
  std::vector<double> crossings;
  Real last = 0.01_r;
  for (int n = 1; n <= 10000; ++n) {
    world.step();
    const Real y = world.states()[0].position.y;
    if ((y > 0) != (last > 0)) crossings.push_back(0.001 * n);
    last = y;
  }
  ASSERT_GE(crossings.size(), 10u);
  const double half_period =
      (crossings.back() - crossings.front()) / static_cast<double>(crossings.size() - 1);
  EXPECT_NEAR(half_period, kPiD / std::sqrt(1.5 * 9.81), 0.002);
}

TEST_P(ExplosionForce, GivesTheImpulseOfItsShellAndWakes) {
  BodyDef def = ball_at({0, 0, 20});
  def.can_sleep = true;
  def.mass = 1000;  // hardly moves while the shell passes
  World world = world_of({def}, 0.0001_r);
  const BodyId id = world.bodies()[0];
  world.add_force(Explosion{.centre = {0, 0, -80},
                            .start = 0.5_r,
                            .peak_force = 5000,
                            .speed = 200,
                            .thickness = 20,
                            .duration = 1});
  bool slept = false;
  double arrived = 0;
  for (int n = 0; n < 12000; ++n) {
    world.step();
    slept = slept || !world.awake(id);
    if (arrived == 0 && world.state(id).velocity.z > 0) arrived = world.time();
  }
  EXPECT_TRUE(slept);
  // The front runs 10 m ahead of the middle: 90 m at 200 m/s after the start.
  EXPECT_NEAR(arrived, 0.5 + 0.45, 0.001);
  // A triangle of peak 5000 (1 - age) N, 0.1 s wide, with its middle at age 0.5: 125 N s (the
  // fading is linear, so it cancels over the triangle), over 1000 kg.
  EXPECT_NEAR(world.state(id).velocity.z, 0.125, 0.001);
  EXPECT_EQ(world.state(id).velocity.x, 0);
}

TEST_P(ExplosionForce, FadesOut) {
  World world = world_of({ball_at({0, 0, 90})});
  world.add_force(Explosion{.peak_force = 5000, .speed = 100, .thickness = 10, .duration = 0.8_r});
  for (int n = 0; n < 200; ++n) world.step();
  EXPECT_EQ(world.states()[0].velocity, Vec3{});
}

}  // namespace
}  // namespace jfpx
