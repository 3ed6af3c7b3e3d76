/// Tests of worlds that come to rest: no sinking, no jitter, sleeping and waking.
#include <jfpx/error.hpp>
#include <jfpx/force.hpp>

#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace jfpx {
namespace {

using test::operator""_r;
using test::on_the_ground;

JFPX_SOLVER_SUITE(Rest);
JFPX_SOLVER_SUITE(Sleep);

BodyDef heavy(const Vec3& position, bool can_sleep, Real radius = 1) {
  BodyDef def = test::ball(position, radius);
  def.acceleration = {0, -9.81_r, 0};
  def.friction = 0.4_r;
  def.can_sleep = can_sleep;
  return def;
}

/// [m], how deep a ball may sink in under `weights` times its weight.
Real depth(const Scene& scene, Real weights) {
  return scene.solver == Solver::worst_first ? scene.resolver.position_epsilon : 2e-4_r * weights;
}

TEST_P(Rest, ABallOnTheGroundNeitherSinksNorJitters) {
  const Scene scene = on_the_ground({heavy({0, 1, 0}, false)});
  World world(scene);
  for (int n = 0; n < 60; ++n) world.step();
  const Real level = world.states()[0].position.y;
  EXPECT_GE(level, 1 - depth(scene, 1));
  for (int n = 0; n < 600; ++n) {
    world.step();
    ASSERT_NEAR(world.states()[0].position.y, level, 1e-6);
    ASSERT_NEAR(world.states()[0].velocity.y, 0, 1e-6);
  }
}

TEST_P(Rest, ABallOnABoxRestsAsOnTheGround) {
  BodyDef table = test::ground();
  table.shape = Box{{5, 1, 5}};
  table.position = {0, -1, 0};
  Scene scene = test::empty_scene();
  scene.bodies = {heavy({0.3_r, 1, 0.2_r}, false), table};
  World world(scene);
  for (int n = 0; n < 300; ++n) world.step();
  EXPECT_GE(world.states()[0].position.y, 1 - depth(scene, 1));
  EXPECT_NEAR(world.states()[0].position.x, 0.3, 1e-4);
}

TEST_P(Rest, AStackOfTenMovesLessThanAMillimetreInTenSeconds) {
  test::expect_that_ten_stand(heavy({0, 1, 0}, false), 2);
}

TEST_P(Rest, AStackOfTenKeepsEachContactWithinTheEpsilonAndFallsAsleep) {
  std::vector<BodyDef> balls;
  for (int i = 0; i < 10; ++i) {
    balls.push_back(heavy({0, 1 + 2 * static_cast<Real>(i), 0}, true));
  }
  Scene scene = on_the_ground(balls);
  scene.resolver.max_iterations = 2000;
  World world(scene);
  StepReport report;
  for (int n = 0; n < 600; ++n) report = world.step();
  EXPECT_EQ(report.awake, 0u);
  Real below = 0, top = 0;
  for (std::size_t i = 0; i < 10; ++i, below = top) {
    top = world.states()[i].position.y;
    ASSERT_GE(top - below, (i == 0 ? 1 : 2) - depth(scene, 10) - 1e-6_r);
  }
}

TEST_P(Rest, AHeapOfBallsComesToRestAboveTheGround) {
  // A short tower of the thesis: it leans, falls over, and its balls come to lie side by side.
  std::vector<BodyDef> balls;
  for (int i = 0; i < 6; ++i) {
    const Real y = 1 + 3 * static_cast<Real>(i);
    balls.push_back(heavy({0.1_r * y, y, 0}, true));
    balls.back().linear_damping = 0.9_r;
    balls.back().angular_damping = 0.1_r;
  }
  Scene scene = on_the_ground(balls);
  World world(scene);
  StepReport report;
  for (int n = 0; n < 6000; ++n) report = world.step();
  EXPECT_EQ(report.awake, 0u);
  for (std::size_t i = 0; i < 6; ++i) {
    const Real height = world.states()[i].position.y;
    EXPECT_GE(height, 1 - scene.resolver.position_epsilon - 1e-5_r);
    // With the soft step, a ball may rest on others.
    const Real highest = GetParam() == Solver::worst_first ? 1 + 1e-5_r : 4;
    EXPECT_LE(height, highest);
  }
}

/// Four balls in a row on the ground, touching, asleep.
World sleeping_row() {
  std::vector<BodyDef> balls;
  for (int i = 0; i < 4; ++i) balls.push_back(heavy({2 * static_cast<Real>(i), 0.995_r, 0}, true));
  World world(on_the_ground(balls));
  for (int n = 0; n < 120; ++n) world.step();
  return world;
}

TEST(SleepInSoftStep, ABodyAtTheTurningPointOfASlowThrowStaysAwake) {
  BodyDef def = test::ball({0, 5, 0}, 0.5_r);
  def.acceleration = {0, -0.05_r, 0};
  def.velocity = {0.02_r, 0.1_r, 0};
  Scene scene;
  scene.bodies = {def, test::ground()};
  World world(scene);
  Real height = 5;
  for (int n = 0; n < 3600 && world.step().awake > 0; ++n) height = world.states()[0].position.y;
  EXPECT_LT(height, 0.51_r);
}

TEST(SleepInSoftStep, ABodyThatIsPushedOutStaysAwake) {
  Scene scene;
  scene.bodies = {heavy({0, -3.5_r, 0}, true, 0.5_r), test::ground()};
  World world(scene);
  for (int n = 0; n < 3600 && world.step().awake > 0;) ++n;
  EXPECT_NEAR(world.states()[0].position.y, 0.5, 1e-2);
}

TEST_P(Sleep, TouchingBallsFallAsleepTogetherAndKeepTheirContacts) {
  World world = sleeping_row();
  for (std::size_t i = 0; i < 4; ++i) EXPECT_FALSE(world.awake(world.bodies()[i]));
  const auto before = world.states();
  const StepReport report = world.step();
  EXPECT_EQ(report.awake, 0u);
  EXPECT_EQ(report.contacts, 7u);  // three pairs and four on the ground
  EXPECT_EQ(report.position_iterations + report.velocity_iterations, 0u);
  EXPECT_EQ(world.states(), before);
}

TEST_P(Sleep, AHitWakesAllBodiesInContact) {
  World world = sleeping_row();
  BodyDef shot = heavy({-2.2_r, 1, 0}, true);
  shot.velocity = {10, 0, 0};
  world.add(shot);
  world.step();
  world.step();
  for (const BodyId id : world.bodies().first(4)) EXPECT_TRUE(world.awake(id));
  for (int n = 0; n < 5; ++n) world.step();
  EXPECT_GT(world.states()[3].velocity.x, 0.5_r);
}

TEST_P(Sleep, ImmovableBodiesWakeNoBody) {
  World world = sleeping_row();
  const auto before = world.states();
  for (int n = 0; n < 60; ++n) EXPECT_EQ(world.step().awake, 0u);
  EXPECT_EQ(world.states(), before);
}

TEST_P(Sleep, AWokenBodyRespondsToAChangedForce) {
  World world = sleeping_row();
  const ForceId lift = world.add_force(Gravity{{0, 0, 0}});
  for (int n = 0; n < 120; ++n) world.step();
  const BodyId first = world.bodies()[0];
  world.force<Gravity>(lift).acceleration = {0, 50, 0};
  EXPECT_EQ(world.step().awake, 0u) << "a change alone wakes no body";
  world.wake(first);
  EXPECT_TRUE(world.awake(first));
  for (int n = 0; n < 10; ++n) world.step();
  EXPECT_GT(world.state(first).velocity.y, 1);
  // The soft step finds contacts before bodies move, so that the touching neighbors wake too.
  EXPECT_EQ(world.awake(world.bodies()[1]), GetParam() == Solver::soft_step);
  const BodyId ground = world.bodies()[4];
  world.wake(ground);
  EXPECT_FALSE(world.awake(ground)) << "of mass 0";
  world.remove(first);
  EXPECT_THROW(world.wake(first), InvalidArgument);
}

TEST_P(Sleep, ABodyThatLosesItsSupportWakesAndFalls) {
  for (const bool remove : {true, false}) {
    World world(on_the_ground({heavy({0, 0.995_r, 0}, true), heavy({0, 2.99_r, 0}, true)}));
    for (int n = 0; n < 120; ++n) world.step();
    const BodyId below = world.bodies()[0], above = world.bodies()[1];
    ASSERT_FALSE(world.awake(above));
    if (remove) {
      world.remove(below);
    } else {
      world.set_state(below, {{50, 1, 0}, {}, {}, {}});
    }
    for (int n = 0; n < 240; ++n) world.step();
    EXPECT_NEAR(world.state(above).position.y, 1, 0.0101);
  }
}

/// The contacts of a body remain known until the next step has found its new ones.
TEST_P(Sleep, ABodyThatLosesItsSupportAfterOtherChangesWakesToo) {
  using Change = void (*)(World&);
  const Change changes[] = {
      [](World& w) { w.remove(w.bodies()[0]); },  // the other support
      [](World& w) {
        w.add(test::ball({50, 50, 50}, 1));
      },
      [](World& w) {
        w.remove(w.add(test::ball({50, 50, 50}, 1)));
      },
      [](World& w) {  // a step that is undone
        BodyDef runaway = test::ball({50, 50, 50}, 1);
        runaway.velocity = {1e9_r, 0, 0};
        const BodyId id = w.add(runaway);
        for (int n = 0; n < 200 && !w.step().non_finite; ++n) {
        }
        w.remove(id);
      },
  };
  for (const Change& change : changes) {
    SCOPED_TRACE(&change - changes);
    std::vector<BodyDef> pedestals(2);
    pedestals[0].shape = pedestals[1].shape = Box{{1, 0.5_r, 1}};
    pedestals[0].mass = pedestals[1].mass = 0;
    pedestals[0].position = {-5, -0.5_r, 0};
    pedestals[1].position = {5, -0.5_r, 0};
    Scene scene = test::empty_scene();
    scene.bodies = {pedestals[0], pedestals[1], heavy({-5, 0.995_r, 0}, true),
                    heavy({5, 0.995_r, 0}, true)};
    World world(scene);
    const BodyId support = world.bodies()[1], sleeper = world.bodies()[3];
    for (int n = 0; n < 1000 && world.awake(sleeper); ++n) world.step();
    ASSERT_FALSE(world.awake(sleeper));
    change(world);
    world.remove(support);
    EXPECT_TRUE(world.contacts().empty());
    for (int n = 0; n < 60; ++n) world.step();
    EXPECT_LT(world.state(sleeper).position.y, 0);
  }
}

TEST_P(Sleep, ABodyThatCannotSleepKeepsItsNeighborsAwake) {
  World world(on_the_ground({heavy({0, 0.995_r, 0}, false), heavy({0, 2.99_r, 0}, true)}));
  StepReport report;
  for (int n = 0; n < 300; ++n) report = world.step();
  EXPECT_EQ(report.awake, 2u);
}

}  // namespace
}  // namespace jfpx
