/// Tests of the aircraft of the demo flight, against an independent integration of its equations of
/// motion in double with small steps.
#include "src/demos/demo.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace jfpx {
namespace {

using demos::Input;
using V = std::array<double, 3>;

V operator+(V a, const V& b) {
  for (int i = 0; i < 3; ++i) a[i] += b[i];
  return a;
}
V operator*(double s, V a) {
  for (double& x : a) x *= s;
  return a;
}
V cross(const V& a, const V& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// Position, velocity and angular velocity in world axes, and the body's axes as the rows of a
/// matrix that transforms from world axes to body axes.
struct State {
  V x{}, v{}, w{};
  std::array<V, 3> axes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
};
V to_body(const State& s, const V& v) {
  V r{};
  for (int i = 0; i < 3; ++i)
    r[i] = s.axes[i][0] * v[0] + s.axes[i][1] * v[1] + s.axes[i][2] * v[2];
  return r;
}
V to_world(const State& s, const V& v) {
  return v[0] * s.axes[0] + v[1] * s.axes[1] + v[2] * s.axes[2];
}

struct Controls {
  double minus_z = 0, plus_z = 0, rudder = 0;
};

/// Parameters that the errata change.
struct Physics {
  V inertia{2.5 / 3 * 2, 2.5 / 3 * 5, 2.5 / 3 * 5};  ///< in the original {0.6, 1.5, 1.5}: E22, E23
  double damping = 0.8;  ///< per second; its square in the original: E18
  double arms = 1;       ///< weight of omega x r in the flow at a surface; 0 in the original: E27
};

/// Undamped acceleration and angular acceleration of the thesis' aircraft: 2.5 kg, a thrust of 10
/// N, four surfaces.
void accelerations(const State& s, const Controls& controls, const Physics& physics, V* linear,
                   V* angular) {
  const V w = to_body(s, s.w), v = to_body(s, s.v);
  V force{-10, 0, 0}, torque{};
  const auto surface = [&](const V& point, double yx, double yy, double zx, double zz) {
    const V air = v + physics.arms * cross(w, point);
    const V lift{0, yx * air[0] + yy * air[1], zx * air[0] + zz * air[2]};
    force = force + lift;
    torque = torque + cross(point, lift);
  };
  surface({-1, 0, -2}, -1 - 0.005 * controls.minus_z, -0.5, 0, 0);
  surface({-1, 0, 2}, -1 - 0.005 * controls.plus_z, -0.5, 0, 0);
  surface({2, 0.5, 0}, 0, 0, -0.01 * controls.rudder, 0);
  surface({2, 0, 0}, -1, -0.5, 0, -0.1);
  const V& inertia = physics.inertia;
  const V net_torque =
      torque + -1.0 * cross(w, {inertia[0] * w[0], inertia[1] * w[1], inertia[2] * w[2]});
  *linear = (1 / 2.5) * to_world(s, force) + V{0, -9.81, 0};
  *angular = to_world(
      s, {net_torque[0] / inertia[0], net_torque[1] / inertia[1], net_torque[2] / inertia[2]});
}

State slope(const State& s, const Controls& controls, const Physics& physics) {
  State d;
  accelerations(s, controls, physics, &d.v, &d.w);
  const double rate = -std::log(physics.damping);
  d.x = s.v;
  d.v = d.v + -rate * s.v;
  d.w = d.w + -rate * s.w;
  for (int i = 0; i < 3; ++i) d.axes[i] = cross(s.w, s.axes[i]);
  return d;
}
State moved(const State& s, const State& d, double dt) {
  State r;
  r.x = s.x + dt * d.x;
  r.v = s.v + dt * d.v;
  r.w = s.w + dt * d.w;
  for (int i = 0; i < 3; ++i) r.axes[i] = s.axes[i] + dt * d.axes[i];
  return r;
}
/// One fourth-order Runge-Kutta step, after which the ground limits the height and stops the
/// downward velocity.
State next(const State& s, const Controls& controls, double dt, const Physics& physics = {}) {
  const State a = slope(s, controls, physics), b = slope(moved(s, a, dt / 2), controls, physics);
  const State c = slope(moved(s, b, dt / 2), controls, physics);
  const State d = slope(moved(s, c, dt), controls, physics);
  State r = moved(moved(moved(moved(s, a, dt / 6), b, dt / 3), c, dt / 3), d, dt / 6);
  if (r.x[1] < 0) {
    r.x[1] = 0;
    r.v[1] = std::max(r.v[1], 0.0);
  }
  return r;
}
/// The exact flight without input, to about 1e-3 m.
State flown(double seconds) {
  constexpr int kStepsPerSecond = 4000;
  State s;
  for (int n = 0; n < static_cast<int>(seconds * kStepsPerSecond); ++n) {
    s = next(s, {}, 1.0 / kStepsPerSecond);
  }
  return s;
}

State double_state(const BodyState& b) {
  State s;
  for (int i = 0; i < 3; ++i) {
    s.x[i] = b.position[i];
    s.v[i] = b.velocity[i];
    s.w[i] = b.angular_velocity[i];
    const Vec3 axis = to_matrix(b.orientation).column(i);
    s.axes[i] = {axis.x, axis.y, axis.z};
  }
  return s;
}
BodyState aircraft(const demos::Demo& demo) { return demo.states().front(); }
double speed(const BodyState& s) { return static_cast<double>(length(s.velocity)); }

/// Takes `steps` steps with the control held down, and one with the control released.
void hold(demos::Demo* demo, std::string_view control, int steps) {
  const std::size_t number = find_control(*demo, control);
  demo->step(std::vector<Input>{{number, true}});
  for (int n = 1; n < steps; ++n) demo->step();
  demo->step(std::vector<Input>{{number, false}});
}
void fly(demos::Demo* demo, int steps) {
  for (int n = 0; n < steps; ++n) demo->step();
}

// Validates the model: with the errors and the integrator of the original it reproduces results of
// the original, at 60 Hz without input.
TEST(FlightModel, ReproducesTheOriginalWithItsErrors) {
  const Physics original{.inertia = {0.6, 1.5, 1.5}, .damping = 0.8, .arms = 0};
  const double dt = 1.0 / 60, kept = std::pow(0.8, dt);
  State s;
  for (int n = 1; n <= 1200; ++n) {
    V linear, angular;
    accelerations(s, {}, original, &linear, &angular);
    s.v = kept * (s.v + dt * linear);
    s.x = s.x + dt * s.v;
    s.v = kept * s.v;            // second damping (E18)
    if (s.x[1] < 0) s.x[1] = 0;  // the downward velocity remains (E22)
    if (n == 600) {
      EXPECT_NEAR(s.x[0], -69.85, 0.005);
      EXPECT_NEAR(s.x[1], 1.325, 0.0005);
      EXPECT_NEAR(std::hypot(s.v[0], s.v[1]), 8.851, 0.0005);
    }
  }
  EXPECT_NEAR(s.x[0], -159.25, 0.005);
  EXPECT_NEAR(s.x[1], 9.542, 0.0005);
  EXPECT_NEAR(std::hypot(s.v[0], s.v[1]), 8.970, 0.0005);
}

TEST(Flight, WithoutInputFollowsTheEquationsOfMotion) {
  // At 10 s and 20 s: (-107.55, 39.62), 19.07 m/s and (-279.11, 166.39), 22.46 m/s.
  for (const int seconds : {10, 20}) {
    const State s = flown(seconds);
    double error[2];
    for (const int i : {0, 1}) {
      const int rate = i == 0 ? 60 : 240;
      const auto demo = demos::make("flight", {.dt = Real(1) / static_cast<Real>(rate)});
      fly(demo.get(), seconds * rate);
      const BodyState b = aircraft(*demo);
      error[i] = std::hypot(b.position.x - s.x[0], b.position.y - s.x[1]);
      EXPECT_NEAR(speed(b), std::hypot(s.v[0], s.v[1]), 4.0 / rate);
      EXPECT_EQ(b.position.z, 0);
    }
    EXPECT_LT(error[0], 1);
    EXPECT_NEAR(error[0] / error[1], 4, 1) << "the error is proportional to the length of a step";
  }
}

TEST(Flight, TakesOffAtEightMetresPerSecond) {
  // A lift of 3 kg/s times the speed equals the weight, 2.5 kg * 9.81 m/s^2, at 8.175 m/s.
  const auto demo = demos::make("flight");
  BodyState before;
  int steps = 0;
  for (; aircraft(*demo).position.y == 0 && steps < 600; ++steps) {
    before = aircraft(*demo);
    demo->step();
    const double lift = 3 * -static_cast<double>(before.velocity.x) / 2.5;
    EXPECT_NEAR(demo->world()->last_acceleration(demo->world()->bodies()[0]).y, lift - 9.81, 1e-4);
  }
  EXPECT_NEAR(-before.velocity.x, 8.175, 0.1);
  EXPECT_NEAR(steps / 60.0, 2.73, 0.05);  // the original, damped twice, takes off after 6.98 s
}

TEST(Flight, ControlsRotateTheAircraftAsTheirNamesState) {
  struct Case {
    const char* control;
    Controls controls;
    int axis, sign;  // of the angular velocity; the nose points to -x, the pilot's right is -z
  };
  for (const Case& c :
       {Case{"yaw-right", {0, 0, 0.1}, 1, -1}, Case{"yaw-left", {0, 0, -0.1}, 1, 1},
        Case{"pitch-up", {0.1, 0.1, 0}, 2, -1}, Case{"pitch-down", {-0.1, -0.1, 0}, 2, 1},
        Case{"roll-right", {-0.1, 0.1, 0}, 0, -1}, Case{"roll-left", {0.1, -0.1, 0}, 0, 1}}) {
    SCOPED_TRACE(c.control);
    const auto demo = demos::make("flight"), untouched = demos::make("flight");
    fly(demo.get(), 300);
    fly(untouched.get(), 300);
    const State s = double_state(aircraft(*demo));
    demo->step(std::vector<Input>{{find_control(*demo, c.control), true}});
    untouched->step();
    V linear, angular[2];
    accelerations(s, c.controls, {}, &linear, &angular[0]);
    accelerations(s, {}, {}, &linear, &angular[1]);
    const double kept = std::pow(0.8, 1 / 60.0);
    for (int i = 0; i < 3; ++i) {
      const double expected = (angular[0][i] - angular[1][i]) / 60 * kept;
      const double actual =
          aircraft(*demo).angular_velocity[i] - aircraft(*untouched).angular_velocity[i];
      EXPECT_NEAR(actual, expected, 1e-6) << "xyz"[i];
      if (i == c.axis) {
        EXPECT_GT(actual * c.sign, 1e-5);
      }
    }
  }
}

TEST(Flight, DeflectionsAreLimitedAndResetByLevel) {
  const auto demo = demos::make("flight"), same = demos::make("flight");
  hold(demo.get(), "roll-right", 10);
  hold(same.get(), "roll-right", 200);
  fly(demo.get(), 190);
  EXPECT_EQ(demo->state_hash(), same->state_hash());
  demos::View view;
  demo->draw(&view);
  EXPECT_EQ(view.text.back(), "wings: left +1.0, right -1.0; rudder +0.0");
  demo->step(std::vector<Input>{{find_control(*demo, "level"), true}});
  demo->draw(&view);
  EXPECT_EQ(view.text.back(), "wings: left +0.0, right +0.0; rudder +0.0");
}

TEST(Flight, ACrashRestartsAtRest) {
  const auto demo = demos::make("flight");
  fly(demo.get(), 300);  // takes off, and then rolls until it falls
  const std::size_t roll = find_control(*demo, "roll-right");
  demo->step(std::vector<Input>{{roll, true}});
  BodyState before = aircraft(*demo);
  for (int n = 0; n < 6000 && before.position.x < 0; ++n) {
    const BodyState last = std::exchange(before, aircraft(*demo));
    if (before == BodyState{}) {
      EXPECT_LT(last.velocity.y, -9.5);
      EXPECT_LT(last.position.y, 1);
      return;
    }
    demo->step();
  }
  FAIL() << "the aircraft did not crash";
}

TEST(Erratum, E22_the_ground_stops_the_downward_velocity) {
  const auto demo = demos::make("flight");
  for (int n = 0; n < 100; ++n) {
    demo->step();
    EXPECT_EQ(aircraft(*demo).position.y, 0);
    EXPECT_EQ(aircraft(*demo).velocity.y, 0);  // in the original it remains, and grows
  }
}

TEST(Erratum, E22_the_aircraft_rotates_with_the_inertia_of_its_mass) {
  // The inertia of a block of 2.5 kg; that of the original accelerates 2.8 times as fast.
  const auto demo = demos::make("flight");
  fly(demo.get(), 300);
  State ours = double_state(aircraft(*demo)), original = ours;
  hold(demo.get(), "roll-right", 1);  // two steps with a deflection of 0.1
  for (int n = 0; n < 2000; ++n) {
    ours = next(ours, {-0.1, 0.1, 0}, 1.0 / 60 / 1000);
    original = next(original, {-0.1, 0.1, 0}, 1.0 / 60 / 1000, {.inertia = {0.6, 1.5, 1.5}});
  }
  const double roll = aircraft(*demo).angular_velocity.x;
  EXPECT_NEAR(roll, ours.w[0], 0.1 * std::abs(ours.w[0]));
  EXPECT_GT(std::abs(original.w[0]), 2 * std::abs(roll));
}

}  // namespace
}  // namespace jfpx
