/// Stacks stand, sleep, and stay where they are.
#include "tests/world/quality.hpp"

#include <gtest/gtest.h>

namespace jfpx {
namespace {

using test::operator""_r;

/// Expects that a stack drifts by less than `drift` until `seconds`, after two seconds in which its
/// weight compresses the contacts, and that it falls asleep within 5 s.
void expect_that_it_stands(const Scene& scene, double seconds, double drift = 0.005) {
  World awake(test::awake(scene));
  test::run(&awake, 2);
  const std::vector<BodyState> settled = test::states_of(awake);
  test::run(&awake, seconds - 2);
  EXPECT_LT(test::drift(awake, settled), drift);
  World world(scene);
  EXPECT_LT(test::time_to_sleep(&world, 5), 5);
  EXPECT_LT(test::drift(world, settled), drift);
}

TEST(Stacks, ATowerOf20BoxesStands) { expect_that_it_stands(scenes::make("tower"), 60, 0.03); }
TEST(Stacks, APyramidOf20RowsStands) { expect_that_it_stands(scenes::make("pyramid"), 20); }
TEST(Stacks, AWallOf80BricksStands) {
  expect_that_it_stands(scenes::make("wall", {.spheres = 0}), 10);
}
TEST(Stacks, AWallFallsWhenABallHitsIt) {
  const Scene scene = scenes::make("wall");
  World world(scene);
  test::run(&world, 3);
  const std::vector<BodyState> states = world.states();
  int fallen = 0;
  for (std::size_t i = 0; i < 80; ++i) {
    if (length(states[i].position - scene.bodies[i].position) > 1) ++fallen;
  }
  EXPECT_GT(fallen, 5);
  EXPECT_LT(fallen, 70);
}

TEST(Stacks, A100KgBoxStandsOnA1KgBox) {
  Scene scene;
  scene.bodies = {test::crate({0, 0.5_r, 0}, {0.5_r, 0.5_r, 0.5_r}, 1),
                  test::crate({0, 1.5_r, 0}, {0.5_r, 0.5_r, 0.5_r}, 100), test::ground()};
  World world(test::awake(scene));
  test::run(&world, 10);
  const std::vector<BodyState> states = world.states();
  EXPECT_NEAR(static_cast<double>(states[0].position.y), 0.5, 0.03);
  EXPECT_NEAR(static_cast<double>(states[1].position.y), 1.5, 0.03);
  EXPECT_LT(test::penetration(world).largest, 0.03);
}

TEST(Stacks, AMinuteAtRestMovesNoBodyThatSleeps) {
  for (const char* name : {"pile", "tower", "wall"}) {
    const bool is_pile = std::string(name) == "pile";
    World world(scenes::make(name, {.spheres = is_pile ? 200u : 0u}));
    ASSERT_LT(test::time_to_sleep(&world, 20), 20) << name;
    BodyDef awake = test::ball({0, 100, 0});  // so that steps are not left out
    awake.acceleration = {};
    awake.can_sleep = false;
    world.add(awake);
    const std::uint64_t hash = world.state_hash();
    test::run(&world, 60);
    EXPECT_EQ(world.state_hash(), hash) << name;
  }
}

/// A stack of N bodies of mass m, at rest: contact k carries the weight of the N - k bodies above
/// it. A contact is a spring of stiffness m' w^2, with the reduced mass m' of the pair and twice
/// the frequency against the ground, so that the penetrations are known.
void expect_weights(const BodyDef& lowest, std::uint32_t substeps, double tolerance) {
  constexpr int kBodies = 10;
  Scene scene;
  for (int i = 0; i < kBodies; ++i) {
    scene.bodies.push_back(lowest);
    scene.bodies.back().position.y = static_cast<Real>(i) + 0.5_r;
  }
  scene.bodies.push_back(test::ground());
  scene.soft_step.substeps = substeps;
  World world(test::awake(scene));
  test::run(&world, 15);
  const double hertz = 0.25 * 60 * substeps, omega = 2 * 3.14159265358979 * hertz;
  double below = -0.5;
  for (int i = 0; i < kBodies; ++i) {
    const auto y = static_cast<double>(world.states()[static_cast<std::size_t>(i)].position.y);
    const double weight = (kBodies - i) * test::kGravity;
    const double stiffness = i == 0 ? 4 * omega * omega : 0.5 * omega * omega;
    EXPECT_NEAR(below + 1 - y, weight / stiffness, tolerance * weight / stiffness + 4e-6)
        << "body " << i << ", " << substeps << " substeps";
    below = y;
  }
}

TEST(Stacks, ContactsOfSpheresCarryTheWeightAboveThemAndStiffenWithTheSubsteps) {
  for (const std::uint32_t substeps : {2u, 4u, 8u, 16u}) {
    expect_weights(test::heavy_ball({}, 0.5_r), substeps, 0.01);
  }
}
TEST(Stacks, ContactsOfBoxesCarryTheWeightAboveThemAndStiffenWithTheSubsteps) {
  for (const std::uint32_t substeps : {2u, 4u, 8u, 16u}) {
    expect_weights(test::crate({}, {0.5_r, 0.5_r, 0.5_r}), substeps, 0.02);
  }
}

}  // namespace
}  // namespace jfpx
