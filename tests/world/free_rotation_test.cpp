/// Bodies that rotate without torque keep their angular momentum and their energy.
#include "tests/world/quality.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace jfpx {
namespace {

using test::operator""_r;

/// A box without gravity.
World spinning(const Vec3& half_extents, const Vec3& angular_velocity) {
  Scene scene;
  BodyDef def = test::crate({}, half_extents);
  def.acceleration = {};
  def.angular_velocity = angular_velocity;
  scene.bodies = {def};
  return World(test::awake(scene));
}

struct Rotation {
  Vec3 velocity;  ///< in body axes
  double momentum = 0, energy = 0;
};
Rotation rotation(const World& world) {
  const BodyId id = world.bodies()[0];
  const BodyState state = world.state(id);
  const Vec3 w = to_local_direction(state, state.angular_velocity);
  const Vec3 momentum = world.inertia(id) * w;
  return {w, static_cast<double>(length(momentum)), 0.5 * static_cast<double>(dot(w, momentum))};
}

TEST(FreeRotation, KeepsMomentumAndEnergyForAMinute) {
  for (const Vec3& size :
       {Vec3{0.5_r, 0.1_r, 0.25_r}, {0.5_r, 0.1_r, 0.5_r}, {0.2_r, 0.9_r, 0.2_r}}) {
    for (const Real speed : {0.02_r, 0.2_r, 2._r, 20._r}) {
      World world = spinning(size, Vec3{0.3_r, 0.4_r, 0.9_r} * speed);
      const Rotation start = rotation(world);
      for (int step = 0; step < 3600; ++step) {
        world.step();
        const Rotation now = rotation(world);
        // The velocity is that in the middle of a substep, so that these values oscillate.
        ASSERT_NEAR(now.momentum, start.momentum, 1e-3 * start.momentum) << step;
        ASSERT_NEAR(now.energy, start.energy, 3e-3 * start.energy) << step;
      }
    }
  }
}

/// Counts the changes of the sign of one component that exceeds 10 rad/s.
class TurnCounter {
 public:
  void add(double velocity) {
    if (velocity * side_ < -10) side_ = -side_, ++turns_;
  }
  int turns() const { return turns_; }

 private:
  double side_ = 1;
  int turns_ = 0;
};

/// Euler's equations in body axes for a minute, by the Runge-Kutta method in double precision.
int turns_of_euler(std::array<double, 3> w, const std::array<double, 3>& moments) {
  using Values = std::array<double, 3>;
  const auto slope = [&](const Values& v) {
    const auto& [x, y, z] = moments;
    return Values{(y - z) / x * v[1] * v[2], (z - x) / y * v[2] * v[0], (x - y) / z * v[0] * v[1]};
  };
  const auto moved = [](const Values& v, const Values& d, double dt) {
    return Values{v[0] + d[0] * dt, v[1] + d[1] * dt, v[2] + d[2] * dt};
  };
  constexpr double kStep = 1e-3;
  TurnCounter counter;
  for (int n = 0; n < 60000; ++n) {
    const Values a = slope(w), b = slope(moved(w, a, kStep / 2)), c = slope(moved(w, b, kStep / 2));
    const Values d = slope(moved(w, c, kStep));
    for (std::size_t k = 0; k < 3; ++k) w[k] += kStep / 6 * (a[k] + 2 * b[k] + 2 * c[k] + d[k]);
    counter.add(w[2]);
  }
  return counter.turns();
}

TEST(FreeRotation, AboutTheMiddleAxisTurnsOverAsOftenAsEulersEquations) {
  World world = spinning({0.5_r, 0.1_r, 0.25_r}, {0.2_r, 0.2_r, 20});
  TurnCounter counter;
  for (int step = 0; step < 3600; ++step) {
    world.step();
    counter.add(static_cast<double>(rotation(world).velocity.z));
  }
  // 1/3 (b^2 + c^2) of the half extents b and c
  const int expected = turns_of_euler({0.2, 0.2, 20}, {0.0725 / 3, 0.3125 / 3, 0.26 / 3});
  EXPECT_GT(expected, 40);
  EXPECT_NEAR(counter.turns(), expected, 2);
}

TEST(FreeRotation, OfATopPrecessesAtTheAnalyticRate) {
  // Moments of inertia: 1/3 (0.09 + 0.09) = 0.06 about y, 1/3 (0.09 + 0.01) = 1/30 about x and z.
  World world = spinning({0.3_r, 0.1_r, 0.3_r}, {1, 10, 0});
  const double rate = 10 * (0.06 - 1 / 30.) * 30;  // of the velocity in body axes, about y
  for (int step = 1; step <= 600; ++step) {
    world.step();
    const Vec3 w = rotation(world).velocity;
    ASSERT_NEAR(static_cast<double>(w.y), 10, 1e-3);
    ASSERT_NEAR(std::hypot(static_cast<double>(w.x), static_cast<double>(w.z)), 1, 1e-3);
  }
  const Vec3 w = rotation(world).velocity;
  const double expected = std::remainder(rate * 10, 2 * 3.14159265358979);
  const double angle = std::atan2(static_cast<double>(-w.z), static_cast<double>(w.x));
  EXPECT_NEAR(std::remainder(angle - expected, 2 * 3.14159265358979), 0, 0.1);
}

}  // namespace
}  // namespace jfpx
