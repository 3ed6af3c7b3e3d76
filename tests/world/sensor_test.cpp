/// Tests of sensors: their contacts are reported, not resolved, and wake nothing.
#include "tests/world/random_bodies.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace jfpx {
namespace {

using test::operator""_r;
using test::heavy;

JFPX_SOLVER_SUITE(Sensor);

BodyDef sensor(BodyDef def) {
  def.sensor = true;
  return def;
}
/// A sensor box with half extents of 1 m that moves with constant velocity.
BodyDef moving_sensor(const Vec3& position, const Vec3& velocity) {
  BodyDef def = test::ball(position, 1, 0);
  def.shape = Box{};
  def.kinematic = true;
  def.velocity = velocity;
  return sensor(def);
}
World world_of(std::vector<BodyDef> bodies) {
  Scene scene = test::empty_scene();
  scene.bodies = std::move(bodies);
  return World(scene);
}

TEST_P(Sensor, ReportsABodyThatPassesThroughWithoutChangingItsMotion) {
  BodyDef gate = test::ball({0, -5, 0}, 1, 0);
  gate.shape = Box{{1, 0.5_r, 1}};
  for (const BodyDef& zone : {sensor(gate), sensor(test::ball({0, -5, 0}, 1, 0)),
                              sensor(test::half_space({0, 1, 0}, -5))}) {
    World world = world_of({heavy({0, 0, 0}), zone});
    World alone = world_of({heavy({0, 0, 0})});
    std::string story;
    for (int n = 0; n < 100; ++n) {
      const StepReport report = world.step();
      alone.step();
      ASSERT_EQ(world.states()[0], alone.states()[0]) << n;
      EXPECT_EQ(report.contacts, world.contacts().size());
      EXPECT_EQ(report.velocity_iterations + report.position_iterations, 0u);
      EXPECT_EQ(world.contacts().empty(), world.contact_events().empty() ||
                                              world.contact_events()[0].phase == ContactPhase::end);
      for (const Contact& contact : world.contacts()) {
        EXPECT_TRUE(contact.sensor);
        EXPECT_EQ(contact.a, world.bodies()[0]);
        EXPECT_EQ(contact.b, world.bodies()[1]);
        EXPECT_LE(contact.distance, 0);
      }
      for (const ContactEvent& event : world.contact_events()) {
        story += event.phase == ContactPhase::begin  ? '+'
                 : event.phase == ContactPhase::stay ? '='
                                                     : '-';
      }
    }
    const bool endless = std::holds_alternative<HalfSpace>(zone.shape);
    EXPECT_EQ(story.front(), '+');
    EXPECT_EQ(story.back(), endless ? '=' : '-');
    EXPECT_EQ(std::ranges::count(story, '+'), 1);
    EXPECT_GT(std::ranges::count(story, '='), 5);
  }
}

TEST_P(Sensor, ThatIsMovableFallsThroughEverything) {
  World world = world_of({sensor(heavy({0, 3, 0})), heavy({0, 1, 0}), test::ground()});
  World alone = world_of({sensor(heavy({0, 3, 0}))});
  for (int n = 0; n < 90; ++n) {
    world.step();
    alone.step();
    ASSERT_EQ(world.states()[0], alone.states()[0]) << n;
  }
  EXPECT_NEAR(world.states()[1].position.y, 1, 0.011);
}

TEST_P(Sensor, TwoThatOverlapAreReported) {
  World world = world_of({sensor(test::ball({0, 0, 0})), sensor(test::ball({1, 0, 0}, 1, 0))});
  const StepReport report = world.step();
  EXPECT_EQ(report.contacts, 1u);
  ASSERT_EQ(world.contact_events().size(), 1u);
  EXPECT_TRUE(world.contacts()[0].sensor);
  EXPECT_EQ(world.states()[0].position, Vec3{});
  EXPECT_TRUE(world.sensor(world.bodies()[0]));
}

TEST_P(Sensor, WakesNothingAndKeepsNothingAwake) {
  // A kinematic sensor passes a ball that falls asleep meanwhile; a movable one passes later.
  World world = world_of(
      {heavy({0, 0.995_r, 0}), moving_sensor({-2.5_r, 1, 0}, {0.5_r, 0, 0}), test::ground()});
  const BodyId ball = world.bodies()[0], kinematic = world.bodies()[1];
  bool asleep_in_contact = false;
  for (int n = 0; n < 240; ++n) {
    world.step();
    const bool touched = std::ranges::any_of(
        world.contacts(), [&](const Contact& c) { return c.a == kinematic || c.b == kinematic; });
    asleep_in_contact |= touched && !world.awake(ball);
  }
  EXPECT_TRUE(asleep_in_contact);
  ASSERT_FALSE(world.awake(ball));

  BodyDef flying = sensor(test::ball({3, 1, 0}));
  flying.velocity = {-2, 0, 0};
  const BodyId other = world.add(flying);
  std::size_t begun = 0;
  for (int n = 0; n < 60; ++n) {
    world.step();
    for (const ContactEvent& e : world.contact_events()) {
      begun += e.phase == ContactPhase::begin && e.a == ball && e.b == other;
    }
    ASSERT_FALSE(world.awake(ball)) << n;
  }
  EXPECT_EQ(begun, 1u);

  // Neither moving nor removing a sensor wakes the bodies in contact with it.
  world.set_state(kinematic, {{0, 1, 0}, {}, {1, 0, 0}, {}});
  world.step();
  EXPECT_FALSE(world.awake(ball));
  world.set_state(kinematic, {{0, 2, 0}, {}, {1, 0, 0}, {}});
  world.set_filter(kinematic, {.mask = 0});
  world.remove(other);
  world.remove(kinematic);
  EXPECT_FALSE(world.awake(ball));
  world.step();
  EXPECT_FALSE(world.awake(ball));
}

TEST_P(Sensor, ThatSleepsIsNotWokenByContacts) {
  BodyDef resting = sensor(test::ball({0, 0, 0}));
  resting.can_sleep = true;
  World world = world_of({resting});
  for (int n = 0; n < 120; ++n) world.step();
  const BodyId id = world.bodies()[0];
  ASSERT_FALSE(world.awake(id));
  BodyDef ball = test::ball({3, 0, 0});
  ball.velocity = {-3, 0, 0};
  world.add(ball);
  std::uint64_t contacts = 0;
  for (int n = 0; n < 120; ++n) {
    contacts += world.step().contacts;
    ASSERT_FALSE(world.awake(id));
  }
  EXPECT_GT(contacts, 10u);
  EXPECT_NEAR(world.states()[1].position.x, -3, 1e-4);
}

TEST_P(Sensor, IsMovedByContactGenerators) {
  BodyDef lamp = sensor(heavy({0, 4, 0}));
  World world = world_of({test::ball({0, 5, 0}, 0.1_r, 0), lamp});
  const BodyId hook = world.bodies()[0], hung = world.bodies()[1];
  world.add_contact_generator([=](ContactContext& context) {  // a rope of 1 m
    const Vec3 d = context.state(hung).position - context.state(hook).position;
    if (length(d) < 1) return;
    context.add({.a = hook, .b = hung, .normal = normalized(d), .distance = 1 - length(d)});
  });
  for (int n = 0; n < 240; ++n) world.step();
  EXPECT_NEAR(world.state(hung).position.y, 4, 0.02);
  ASSERT_FALSE(world.awake(hung));
  ASSERT_EQ(world.contacts().size(), 2u);  // the ball around the hook is not resolved
  EXPECT_TRUE(world.contacts()[0].sensor);
  EXPECT_FALSE(world.contacts()[1].sensor);
  world.remove(hook);
  EXPECT_TRUE(world.awake(hung));
}

TEST_P(Sensor, LeavesItsIndexToABodyThatIsNone) {
  World world = world_of({sensor(test::ball({0, 0, 0})), test::ball({1.5_r, 0, 0})});
  const BodyId old = world.bodies()[0];
  world.remove(old);
  const BodyId fresh = world.add(test::ball({0, 0, 0}));
  ASSERT_EQ(fresh.index, old.index);
  EXPECT_FALSE(world.sensor(fresh));
  world.step();
  ASSERT_EQ(world.contacts().size(), 1u);
  EXPECT_FALSE(world.contacts()[0].sensor);
  EXPECT_LT(world.state(fresh).position.x, 0);
}

/// The other bodies move as in a world without the sensors, to the last bit, and have the same
/// contacts in the same order.
TEST_P(Sensor, ChangesNoBitOfOtherBodiesInRandomWorlds) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  std::uint64_t sensed = 0, resolved = 0;
  for (int round = 0; round < 12; ++round) {
    Scene scene = test::empty_scene();
    scene.resolver.max_iterations = 400;
    for (int i = 0; i < 30; ++i) {
      scene.bodies.push_back(test::random_body(&random, 2));
      scene.bodies.back().filter.category = 1u << random.below(3);
    }
    scene.bodies.push_back(test::half_space({0, 1, 0}, -2));
    const std::size_t others = scene.bodies.size();
    World plain(scene);
    for (int i = 0; i < 12; ++i) {
      BodyDef def = test::random_body(&random, 2);
      def.kinematic = def.mass == 0 && !std::holds_alternative<HalfSpace>(def.shape) &&
                      !std::holds_alternative<Plane>(def.shape);
      def.velocity = random.uniform_in_box({-2, -2, -2}, {2, 2, 2});
      def.filter.mask = ~1u;
      scene.bodies.push_back(sensor(def));
    }
    const auto way = static_cast<BroadPhase>(round % 3);
    World world(scene, {.collider = {}, .broad_phase = way});
    for (int n = 0; n < 60; ++n) {
      plain.step();
      world.step();
      std::vector<Contact> of_others;
      for (const Contact& c : world.contacts()) {
        const bool of_sensor = c.a.index >= others || c.b.index >= others;
        ASSERT_EQ(c.sensor, of_sensor);
        ++(of_sensor ? sensed : resolved);
        if (!of_sensor) of_others.push_back(c);
      }
      ASSERT_TRUE(std::ranges::equal(of_others, plain.contacts())) << n;
      std::vector<BodyState> states = world.states();
      states.resize(others);
      ASSERT_EQ(state_hash(states), plain.state_hash()) << n;
      for (const BodyId id : plain.bodies()) ASSERT_EQ(world.awake(id), plain.awake(id));
    }
  }
  EXPECT_GT(sensed, 1000u);
  EXPECT_GT(resolved, 1000u);
}

}  // namespace
}  // namespace jfpx
