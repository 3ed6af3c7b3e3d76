/// Tests of the free motion of bodies with Solver::worst_first: forces, damping, sleep.
#include "src/thesis/free_motion.hpp"

#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace jfpx {
namespace {

using test::operator""_r;

constexpr Real kDt = 0.01_r;

/// Bodies without contacts.
struct MovingBodies : BodyStore {
  explicit MovingBodies(const SleepSettings& sleep = {})
      : BodyStore(kDt, sleep), motion(kDt, sleep) {}
  void integrate() { motion.integrate(this); }
  thesis::FreeMotion motion;
};

TEST(FreeMotion, AForceActsForOneStep) {
  MovingBodies store;
  const std::uint32_t i = store.add(test::ball({}, 1, 2)).index;
  store.apply_force(i, {6, 0, 0});
  store.apply_torque(i, {0, 0, 1.6_r});
  store.integrate();
  const Vec3 velocity = store.moving.velocity[i];
  EXPECT_NEAR(velocity.x, 3 * kDt, 4 * kEpsilon);  // F/m dt
  // I = 0.4 * 2 * 1 = 0.8, so the angular acceleration is 2.
  EXPECT_NEAR(store.moving.angular_velocity[i].z, 2 * kDt, 4 * kEpsilon);
  EXPECT_EQ(store.moving.last_acceleration[i].x, 3);
  store.integrate();
  EXPECT_EQ(store.moving.velocity[i], velocity);
}

TEST(Erratum, E14_turning_about_z_carries_x_to_y) {
  MovingBodies store;
  BodyDef def = test::ball({});
  def.angular_velocity = {0, 0, kPi / 2};
  const std::uint32_t i = store.add(def).index;
  for (int step = 0; step < 100; ++step) store.integrate();
  const Vec3 x = rotate(store.moving.orientation[i], {1, 0, 0});
  EXPECT_NEAR(x.x, 0, 1e-3);
  EXPECT_NEAR(x.y, 1, 1e-3);
}

TEST(Erratum, E18_damping_acts_once_a_step) {
  MovingBodies store;
  BodyDef def = test::ball({});
  def.velocity = {8, 0, 0};
  def.angular_velocity = {0, 4, 0};
  def.linear_damping = 0.5_r;
  def.angular_damping = 0.25_r;
  const std::uint32_t i = store.add(def).index;
  for (int step = 0; step < 100; ++step) store.integrate();
  EXPECT_NEAR(store.moving.velocity[i].x, 4, 1e-4);  // half is left after one second
  EXPECT_NEAR(store.moving.angular_velocity[i].y, 1, 1e-4);
}

TEST(Erratum, E19_nothing_moves_an_immovable_body) {
  MovingBodies store;
  BodyDef def = test::ball({1, 2, 3}, 1, 0);
  def.acceleration = {0, -9.81_r, 0};
  def.velocity = {1, 1, 1};
  def.angular_velocity = {1, 1, 1};
  const std::uint32_t i = store.add(def).index;
  store.apply_force(i, {1, 1, 1});
  store.apply_torque(i, {1, 1, 1});
  for (int step = 0; step < 10; ++step) store.integrate();
  EXPECT_EQ(store.state(i), (BodyState{{1, 2, 3}, {}, {}, {}}));
  EXPECT_EQ(store.moving.awake[i], 0);
}

TEST(Erratum, E29_a_weak_force_wakes_a_body_for_long_enough_to_move_it) {
  MovingBodies store;
  BodyDef def = test::ball({});
  def.can_sleep = true;
  const std::uint32_t i = store.add(def).index;
  for (int step = 0; step < 200; ++step) store.integrate();
  ASSERT_EQ(store.moving.awake[i], 0);
  // With a = 5 the mean motion stays above epsilon until v^2 does: v^2 > 0.3 after 11 steps, when
  // the mean has fallen from 0.6 to 0.6 * 0.05^0.11 = 0.43 at least.
  for (int step = 0; step < 100; ++step) {
    store.apply_force(i, {5, 0, 0});
    store.integrate();
    ASSERT_EQ(store.moving.awake[i], 1);
  }
  EXPECT_NEAR(store.moving.velocity[i].x, 5, 1e-4);
}

TEST(Erratum, E30_a_default_body_moves_and_is_awake) {
  MovingBodies store;
  BodyDef def;
  def.velocity = {1, 0, 0};
  const std::uint32_t i = store.add(def).index;
  EXPECT_EQ(store.moving.awake[i], 1);
  EXPECT_EQ(store.moving.mean_motion[i], 2 * SleepSettings{}.epsilon);
  store.integrate();
  EXPECT_EQ(store.moving.velocity[i].x, 1);
  EXPECT_EQ(store.moving.position[i].x, kDt);
}

TEST(Sleep, FollowsTheRecencyWeightedMeanOfMotion) {
  const SleepSettings sleep{.enabled = true, .epsilon = 0.3_r, .bias = 0.05_r};
  MovingBodies store(sleep);
  BodyDef def = test::ball({});
  def.can_sleep = true;
  def.velocity = {0.4_r, 0, 0};
  def.angular_velocity = {0, 0.3_r, 0};
  const std::uint32_t i = store.add(def).index;
  // v.v + w.w = 0.25, so the mean is 0.25 + 0.35 * 0.05^t: below 0.3 from t = ln 7 / ln 20 = 0.65.
  int steps = 0;
  double mean = 0.6;
  while (mean >= 0.3) {
    ASSERT_EQ(store.moving.awake[i], 1) << steps;
    store.integrate();
    mean = 0.25 + 0.35 * std::pow(0.05, 0.01 * ++steps);
  }
  EXPECT_EQ(steps, 65);
  EXPECT_EQ(store.moving.awake[i], 0);
  EXPECT_EQ(store.moving.velocity[i], Vec3{});
  EXPECT_EQ(store.moving.angular_velocity[i], Vec3{});
}

TEST(Sleep, AFastPastIsForgottenInBoundedTime) {
  MovingBodies store;
  BodyDef def = test::ball({});
  def.can_sleep = true;
  def.velocity = {1000, 0, 0};
  const std::uint32_t i = store.add(def).index;
  for (int step = 0; step < 10; ++step) store.integrate();
  EXPECT_EQ(store.moving.mean_motion[i], 10 * SleepSettings{}.epsilon);
  store.moving.velocity[i] = {};
  // 3.0 * 0.05^t < 0.3 from t = ln 10 / ln 20 = 0.769.
  int steps = 0;
  while (store.moving.awake[i] != 0) store.integrate(), ++steps;
  EXPECT_EQ(steps, 77);
}

TEST(Sleep, RespectsCanSleepAndTheSettings) {
  MovingBodies off({.enabled = false, .epsilon = 0.3_r, .bias = 0.05_r});
  BodyDef def = test::ball({});
  def.can_sleep = true;
  const std::uint32_t i = off.add(def).index;
  MovingBodies on;
  def.can_sleep = false;
  const std::uint32_t j = on.add(def).index;
  for (int step = 0; step < 1000; ++step) off.integrate(), on.integrate();
  EXPECT_EQ(off.moving.awake[i], 1);
  EXPECT_EQ(on.moving.awake[j], 1);
}

}  // namespace
}  // namespace jfpx
