/// Tests of the demo fountain: numbers of balls, and equal bits on all backends.
#include <jfpx/error.hpp>

#include "src/demos/demo.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace jfpx {
namespace {

using demos::Demo;
using demos::Input;

constexpr std::size_t kWalls = 5;

std::size_t balls(const Demo& demo) { return demo.world()->bodies().size() - kWalls; }

TEST(Fountain, BallsComeAndGoByTheHundredPerStep) {
  const auto demo = demos::make("fountain");
  for (const std::size_t expected : {100u, 200u, 300u}) {
    demo->step();
    EXPECT_EQ(balls(*demo), expected);
  }
}

TEST(Fountain, EachBallLivesThreeSecondsAndStaysInTheBasin) {
  for (const int rate : {30, 60, 120}) {
    const auto demo = demos::make(
        "fountain", {.scene = {.spheres = 720}, .dt = Real(1) / static_cast<Real>(rate)});
    for (int n = 0; n < 3 * rate; ++n) demo->step();
    EXPECT_EQ(balls(*demo), 720u) << rate;
    const BodyId oldest = demo->world()->bodies()[kWalls];
    Real highest = 0;
    for (int n = 0; n < rate / 2; ++n) {
      demo->step();
      ASSERT_EQ(balls(*demo), 720u) << rate;
      for (const BodyState& state : demo->states()) {
        ASSERT_GT(state.position.y, -2) << rate;  // the floor's middle is at -1 m
        highest = std::max(highest, state.position.y);
      }
    }
    EXPECT_FALSE(demo->world()->contains(oldest)) << rate;
    EXPECT_NEAR(highest, 4.7, 0.5) << rate;  // 0.6 m + v^2 / 2g
    demo->step(std::vector<Input>{{find_control(*demo, "jet"), true}});
    for (int n = 0; n < 3 * rate; ++n) demo->step();
    EXPECT_EQ(balls(*demo), 0u) << rate;
  }
}

TEST(Fountain, HasTheSameBitsWithAnyNumberOfThreadsOnEveryBackend) {
  const auto hash = [](const WorldSettings& settings) {
    const auto demo =
        demos::make("fountain", {.scene = {.spheres = 900, .seed = 7}, .world = settings});
    for (int n = 0; n < 200; ++n) demo->step();
    return demo->state_hash();
  };
  const std::uint64_t expected = hash({.collider = {.backend = Backend::cpu}});
  EXPECT_EQ(hash({.collider = {.backend = Backend::cpu}, .threads = 3}), expected);
  for (const BackendStatus& status : available_backends()) {
    if (!status.usable) continue;
    EXPECT_EQ(hash({.collider = {.backend = status.backend}}), expected)
        << to_string(status.backend);
  }
}

TEST(Fountain, TakesANumberOfSpheresAndASeedButNoBoxes) {
  const auto none = demos::make("fountain", {.scene = {.spheres = 0}});
  none->step();
  EXPECT_EQ(balls(*none), 0u);
  const auto hash = [](std::uint64_t seed) {
    const auto demo = demos::make("fountain", {.scene = {.spheres = 180, .seed = seed}});
    demo->step();
    return demo->state_hash();
  };
  EXPECT_NE(hash(1), hash(2));
  EXPECT_THROW(demos::make("fountain", {.scene = {.boxes = 1}}), InvalidArgument);
}

}  // namespace
}  // namespace jfpx
