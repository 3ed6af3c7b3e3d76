/// Tests of the two ballistic demos: trajectories and lifetime of rounds, and collisions with
/// crates.
#include "src/demos/demo.hpp"
#include "tests/world/support.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace jfpx {
namespace {

using demos::Demo;
using demos::Input;
using test::operator""_r;
using ::testing::HasSubstr;

constexpr double kEps = std::numeric_limits<Real>::epsilon();

/// Takes one step, within which the controls are pressed and released.
void step(Demo* demo, std::vector<std::string_view> controls = {}) {
  std::vector<Input> inputs;
  for (const std::string_view control : controls) {
    inputs.push_back({find_control(*demo, control), true});
    inputs.push_back({find_control(*demo, control), false});
  }
  demo->step(inputs);
}

std::string text(const Demo& demo) {
  demos::View view;
  demo.draw(&view);
  return view.text.front();
}

/// A round of ballistic, along y and z, with the numbers of the thesis.
struct Shot {
  const char* weapon;
  double vy, vz, ay, damping;
};
constexpr Shot kShots[] = {{"pistol", 0, 35, -1, 0.99},
                           {"artillery", 30, 40, -20, 0.99},
                           {"fireball", 0, 10, 0.6, 0.9},
                           {"laser", 0, 100, 0, 0.99}};

struct Position {
  double y, z;
};
/// Solution of dv/dt = a - k v with k = -ln(damping).
Position flown(const Shot& shot, double t) {
  const double k = -std::log(shot.damping), gone = (1 - std::exp(-k * t)) / k;
  return {1.5 + (shot.vy - shot.ay / k) * gone + shot.ay / k * t, shot.vz * gone};
}
/// [s], time of removal: the round reaches the ground, a range of 200 m, or an age of 5 s.
double end_of(const Shot& shot) {
  const auto spent = [&](double t) {
    const Position p = flown(shot, t);
    return p.y < 0 || p.z > 200;
  };
  double low = 0, high = 5;
  if (!spent(high)) return 5;
  for (int n = 0; n < 60; ++n) (spent((low + high) / 2) ? high : low) = (low + high) / 2;
  return high;
}

TEST(Ballistic, RoundsFollowTheEquationOfMotion) {
  // Ends: 1.737 s at 60.27 m, 3.035 s at 119.56 m, 5 s at 38.87 m, 2.020 s at 200 m.
  for (const Shot& shot : kShots) {
    SCOPED_TRACE(shot.weapon);
    for (const int rate : {60, 100, 1000}) {
      const auto demo = demos::make("ballistic", {.dt = Real(1) / static_cast<Real>(rate)});
      step(demo.get(), {shot.weapon, "fire"});
      int steps = 1;
      for (; !demo->states().empty(); ++steps) {
        const Position exact = flown(shot, static_cast<double>(steps) / rate);
        const Vec3 position = demo->states()[0].position;
        // A step moves with the velocity at its end, which differs from the mean velocity by half
        // the change of velocity in a step.
        ASSERT_NEAR(position.y, exact.y, 65.0 / rate) << "step " << steps;
        ASSERT_NEAR(position.z, exact.z, 10.0 / rate) << "step " << steps;
        ASSERT_EQ(position.x, 0);
        step(demo.get());
      }
      EXPECT_NEAR(static_cast<double>(steps) / rate, end_of(shot), 2.0 / rate) << rate << " Hz";
    }
  }
}

TEST(Ballistic, FiresOncePerPressUpToTheMaximum) {
  const auto demo = demos::make("ballistic");
  EXPECT_THAT(text(*demo), HasSubstr("laser, 0 of 160"));
  const std::size_t fire = find_control(*demo, "fire");
  demo->step(std::vector<Input>{{fire, true}});
  step(demo.get());
  EXPECT_EQ(demo->states().size(), 1u);  // still held down
  demo->step(std::vector<Input>{{fire, false}});
  std::vector<std::string_view> burst(300, "fire");
  burst.insert(burst.begin(), "artillery");
  step(demo.get(), burst);
  EXPECT_EQ(demo->states().size(), 160u);
  EXPECT_THAT(text(*demo), HasSubstr("artillery, 160 of 160"));
  step(demo.get(), {"reset"});
  EXPECT_TRUE(demo->states().empty());
  EXPECT_THAT(text(*demo), HasSubstr("laser, 0 of 160"));
}

TEST(Erratum, E45_fireballs_free_their_slot_after_five_seconds) {
  for (const char* name : {"ballistic", "big-ballistic"}) {
    const auto demo = demos::make(name, {.dt = 0.125_r});
    const std::size_t others = demo->states().size();
    step(demo.get(), {"fireball", "fire"});
    for (int n = 1; n < 40; ++n) step(demo.get());
    EXPECT_EQ(demo->states().size(), others + 1) << name;
    step(demo.get());
    EXPECT_EQ(demo->states().size(), others) << name;
  }
}

TEST(Erratum, E45_each_round_keeps_the_weapon_that_fired_it) {
  const auto demo = demos::make("ballistic");
  step(demo.get(), {"artillery", "fire", "fireball", "fire", "pistol"});
  const double q = std::pow(0.99, 1.0 / 60), f = std::pow(0.9, 1.0 / 60);
  ASSERT_EQ(demo->states().size(), 2u);
  EXPECT_NEAR(demo->states()[0].velocity.z, 40 * q, 200 * kEps);
  EXPECT_NEAR(demo->states()[1].velocity.z, 10 * f, 200 * kEps);
}

TEST(Erratum, E44_rounds_move_once_per_step) {
  const auto demo = demos::make("big-ballistic", {.dt = 0.01_r});
  step(demo.get(), {"laser", "fire"});
  const double q = std::pow(0.99, 0.01);
  EXPECT_NEAR(demo->states().back().position.z, q, 100 * kEps);  // 100 m/s for 0.01 s, damped
  step(demo.get());
  EXPECT_NEAR(demo->states().back().position.z, q + q * q, 100 * kEps);
}

TEST(Erratum, E44_crates_stay_where_they_stand) {
  const auto demo = demos::make("big-ballistic");
  for (int n = 0; n < 300; ++n) step(demo.get());
  ASSERT_EQ(demo->states().size(), 3u);
  for (const int crate : {0, 1}) {  // in the original they overlap initially and fly apart
    const Vec3 position = demo->states()[crate].position;
    EXPECT_NEAR(position.x, 0, 0.01);
    EXPECT_NEAR(position.y, 2, 0.015);
    EXPECT_NEAR(position.z, 50 + 4 * crate, 0.01);
    EXPECT_FALSE(demo->world()->awake(demo->world()->bodies()[crate]));
  }
}

TEST(Erratum, E44_crates_are_drawn_as_large_as_they_are) {
  const auto demo = demos::make("big-ballistic");
  demos::View view;
  demo->draw(&view);
  EXPECT_EQ(std::ranges::count(view.items, Shape(Box{{2, 2, 2}}), &demos::Item::shape), 2 + 2);
}

TEST(BigBallistic, ARoundTransfersItsMomentumToTheCrate) {
  // The pistol's round of 1.5 kg hits the front of the first crate (z = 48) after 2.43 s with
  // 19.5 m/s. Its 29 kg m/s accelerate one crate, or both, to 1.8 to 3.7 m/s, less the effect of
  // friction since then, 0.9 * 9.81 / 60 m/s per step.
  const auto demo = demos::make("big-ballistic");
  step(demo.get(), {"pistol", "fire"});
  int steps = 1;
  BodyState last;
  for (; demo->states().size() == 4 && steps < 300; ++steps) {
    last = demo->states().back();
    step(demo.get());
  }
  EXPECT_NEAR(steps / 60.0, 2.43, 0.05);
  EXPECT_NEAR(last.position.z, 48 - 0.2, 0.4);
  double momentum = 0;
  for (const int crate : {0, 1}) momentum += 8 * demo->states()[crate].velocity.z;
  EXPECT_GT(momentum, 29 * 0.7);
  EXPECT_LT(momentum, 29 * 1.15);  // a restitution of 0.1 adds momentum
}

TEST(BigBallistic, RoundsRestOnTheGroundUntilTheyExpire) {
  // The artillery's round hits the ground after 3 s, behind the crates.
  const auto demo = demos::make("big-ballistic");
  step(demo.get(), {"artillery", "fire"});
  for (int n = 0; n < 240; ++n) step(demo.get());
  ASSERT_EQ(demo->states().size(), 4u);
  EXPECT_NEAR(demo->states().back().position.y, 0.4, 0.1);
  EXPECT_GT(demo->states().back().position.z, 100);
  for (int n = 0; n < 62; ++n) step(demo.get());
  EXPECT_EQ(demo->states().size(), 3u);
}

}  // namespace
}  // namespace jfpx
