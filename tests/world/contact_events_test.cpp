/// Tests of contact events: begin and end, rest, sleep, removal, set_state() and failed steps.
#include <jfpx/error.hpp>

#include "tests/world/random_bodies.hpp"
#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace jfpx {
namespace {

using test::operator""_r;
using test::heavy;

JFPX_SOFT_STEP_SUITE(ContactEvents);

/// Phases and indices of a step's events, as "+0-1 =0-2 -1-2".
std::string to_string_of_events(const World& world) {
  std::string text;
  for (const ContactEvent& e : world.contact_events()) {
    if (!text.empty()) text += ' ';
    text += e.phase == ContactPhase::begin ? '+' : e.phase == ContactPhase::stay ? '=' : '-';
    text += std::to_string(e.a.index) + '-' + std::to_string(e.b.index);
  }
  return text;
}
std::string step(World* world) {
  world->step();
  return to_string_of_events(*world);
}

/// The overlap is nearly that of the balls at rest: a larger one would be pushed out, and the
/// contacts would end for a moment.
World two_resting_balls() {
  Scene scene = test::empty_scene();
  scene.bodies = {heavy({0, 0.9999_r, 0}), heavy({0, 2.9997_r, 0}), test::ground()};
  return World(scene);
}

TEST_P(ContactEvents, OfAnEmptyWorldAreNone) {
  World world{test::empty_scene()};
  EXPECT_TRUE(world.contact_events().empty());
  EXPECT_EQ(step(&world), "");
}

TEST(ContactEvents, OfABallThatReboundsWithinAStepBeginAndEnd) {
  Scene scene;
  BodyDef ball = heavy({0, 2.0_r, 0});
  ball.restitution = 1;
  scene.bodies = {ball, test::ground()};
  scene.bodies[1].restitution = 1;
  World world(scene);
  int rebounds = 0, begun = 0, ended = 0;
  for (int n = 0; n < 600; ++n) {
    const bool falls = world.states()[0].velocity.y < 0;
    const std::string events = step(&world);
    if (falls && world.states()[0].velocity.y > 0) {
      ++rebounds;
      EXPECT_EQ(events, "+0-1") << n;
      EXPECT_EQ(world.contacts().size(), 1u) << n;
      EXPECT_LE(world.contacts()[0].distance, 0) << n;
    }
    begun += events == "+0-1", ended += events == "-0-1";
  }
  EXPECT_GT(rebounds, 10);
  EXPECT_EQ(begun, rebounds);
  EXPECT_EQ(ended, rebounds);
}

/// A corner or an edge of a box may push in a part of a step only, also without a rebound.
TEST(ContactEvents, OfBoxesThatMeetWithinAStepBegin) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  int impacts = 0;
  for (int n = 0; n < 600; ++n) {
    BodyDef box;
    box.shape = Box{{0.5_r, 0.5_r, 0.5_r}};
    box.mass = 1;
    box.restitution = static_cast<Real>(n % 3) * 0.5_r;
    box.acceleration = {};
    Scene scene;
    scene.bodies = {box, box};
    BodyDef& other = scene.bodies[1];
    other.position = {random.uniform(1.4_r, 1.6_r), random.uniform(-0.2_r, 0.2_r), 0};
    other.orientation = test::random_rotation(&random);
    other.velocity = {random.uniform(-12, -0.5_r), 0, 0};
    World world(scene);
    bool has_begun = false, has_pushed = false;
    for (int k = 0; k < 90; ++k) {
      has_begun |= step(&world).starts_with('+');
      has_pushed |= !(world.states()[0].velocity == Vec3{});
    }
    EXPECT_TRUE(has_begun || !has_pushed) << n;
    impacts += has_pushed ? 1 : 0;
  }
  EXPECT_GT(impacts, 300);
}

/// Balls that meet slowly do not rebound, and may have parted at the end of the step.
TEST(ContactEvents, OfBallsThatMeetSlowlyWithinAStepBegin) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int n = 0; n < 600; ++n) {
    BodyDef ball;
    ball.mass = 1;
    ball.restitution = static_cast<Real>(n % 3) * 0.5_r;
    ball.acceleration = {};
    ball.can_sleep = false;
    Scene scene;
    scene.bodies = {ball, ball};
    BodyDef& other = scene.bodies[1];
    other.position = {random.uniform(1.001_r, 1.01_r), random.uniform(-0.5_r, 0.5_r) * 0.01_r, 0};
    other.velocity = {random.uniform(-0.24_r, -0.05_r), 0, 0};
    World world(scene);
    bool has_begun = false;
    for (int k = 0; k < 20; ++k) has_begun |= step(&world).starts_with('+');
    ASSERT_NE(world.states()[0].velocity, Vec3{}) << n;
    EXPECT_TRUE(has_begun) << n;
  }
}

// Solver::soft_step resolves an impact before the bodies touch.
TEST(ContactEvents, BeginStayAndEndWithABounce) {
  Scene scene = test::thesis_scene();
  BodyDef ball = heavy({0, 1.5_r, 0});
  ball.restitution = 1;
  BodyDef ground = test::ground();
  ground.restitution = 1;
  scene.bodies = {ball, ground};
  World world(scene);
  std::string story;
  for (int n = 0; n < 40; ++n) {
    const std::string now = step(&world);
    const std::string touching = world.contacts().empty() ? "" : now;
    if (!touching.empty()) {
      EXPECT_EQ(world.contact_events()[0].distance, world.contacts()[0].distance);
    }
    story += now.empty() ? "." : now.substr(0, 1);
  }
  // Falls for 0.32 s = 19 steps, touches, flies up and falls for 38.
  EXPECT_EQ(story.find_first_not_of('.'), story.find('+'));
  EXPECT_NE(story.find("+-."), std::string::npos) << story;
  EXPECT_EQ(story.find("++"), std::string::npos) << story;
}

TEST_P(ContactEvents, DescribeTheDeepestContactOfAPairInEitherOrder) {
  Scene scene = test::empty_scene();
  BodyDef box = test::ball({0, 0.4_r, 0});
  box.shape = Box{{1, 0.5_r, 1}};
  box.orientation = normalized(Quat{1, 0, 0, 0.01_r});  // the corners at -x are the deeper ones
  scene.bodies = {test::ground(), box};
  World world(scene);
  ASSERT_EQ(step(&world), "+0-1");
  const ContactEvent& event = world.contact_events()[0];
  EXPECT_EQ(event.a, world.bodies()[0]);
  EXPECT_EQ(event.b, world.bodies()[1]);
  EXPECT_EQ(event.contacts, 4u);
  EXPECT_EQ(event.normal, (Vec3{0, -1, 0}));  // from the box to the ground
  Real deepest = 0;
  for (const Contact& c : world.contacts()) deepest = std::min(deepest, c.distance);
  EXPECT_EQ(event.distance, deepest);
  EXPECT_LT(event.point.x, 0);
}

TEST_P(ContactEvents, StayThroughSleep) {
  World world = two_resting_balls();
  EXPECT_EQ(step(&world), "+0-1 +0-2");
  for (int n = 0; n < 120; ++n) ASSERT_EQ(step(&world), "=0-1 =0-2");
  EXPECT_FALSE(world.awake(world.bodies()[0]));
}

TEST_P(ContactEvents, OfARemovedBodyEndInTheNextStep) {
  World world = two_resting_balls();
  step(&world);
  const BodyId gone = world.bodies()[0];
  // A body is removed while the list is read; the list remains valid.
  const auto events = world.contact_events();
  world.remove(events[0].a);
  EXPECT_EQ(to_string_of_events(world), "+0-1 +0-2");
  EXPECT_EQ(step(&world), "-0-1 -0-2");
  EXPECT_EQ(world.contact_events()[0].a, gone);
  EXPECT_EQ(step(&world), "");
}

TEST_P(ContactEvents, DistinguishANewBodyFromTheOldOneWithItsIndex) {
  World world = two_resting_balls();
  step(&world);
  const BodyId old = world.bodies()[0];
  world.remove(old);
  const BodyId fresh = world.add(heavy({0, 0.9999_r, 0}));
  ASSERT_EQ(fresh.index, old.index);
  EXPECT_EQ(step(&world), "-0-1 +0-1 -0-2 +0-2");
  EXPECT_EQ(world.contact_events()[0].a, old);
  EXPECT_EQ(world.contact_events()[1].a, fresh);
}

TEST_P(ContactEvents, FollowABodyThatIsMoved) {
  World world = two_resting_balls();
  step(&world);
  world.set_state(world.bodies()[1], {{50, 0.995_r, 0}, {}, {}, {}});
  EXPECT_EQ(step(&world), "-0-1 =0-2 +1-2");
  world.set_state(world.bodies()[1], {{50, 9, 0}, {}, {}, {}});
  EXPECT_EQ(step(&world), "=0-2 -1-2");
}

TEST_P(ContactEvents, OfAFailedStepAreNoneAndTheNextComparesWithTheLastThatSucceeded) {
  World world = two_resting_balls();
  step(&world);
  bool fail = true;
  const ForceId force = world.add_force([&fail](ForceContext&) {
    if (fail) throw InvalidArgument("on purpose");
  });
  EXPECT_THROW(world.step(), InvalidArgument);
  EXPECT_EQ(to_string_of_events(world), "");
  EXPECT_THROW(world.step(), InvalidArgument);
  fail = false;
  EXPECT_EQ(step(&world), "=0-1 =0-2");

  // A runaway body fails a step after contacts were found.
  BodyDef runaway = test::ball({50, 0, 0});
  runaway.velocity.y = std::numeric_limits<Real>::max() / 2;
  const BodyId id = world.add(runaway);
  ASSERT_TRUE(world.step().non_finite);
  EXPECT_EQ(to_string_of_events(world), "");
  world.remove(id);
  world.remove_force(force);
  EXPECT_EQ(step(&world), "=0-1 =0-2");
}

TEST_P(ContactEvents, AreTheDifferencesOfTheContactListsInARandomWorld) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  Scene scene = test::empty_scene();
  for (int i = 0; i < 40; ++i) {
    BodyDef def = test::ball(random.uniform_in_box({-3, 1, -3}, {3, 9, 3}));
    if (i % 2 != 0) def.shape = Box{{0.5_r, 0.7_r, 0.9_r}};
    if (i % 9 == 0) def.mass = 0;
    def.acceleration = {0, -9.81_r, 0};
    scene.bodies.push_back(def);
  }
  scene.bodies.insert(scene.bodies.begin() + 20, test::ground());
  World world(scene);
  using Pairs = std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t>;
  Pairs before;
  std::uint64_t begun = 0, ended = 0;
  for (int n = 0; n < 200; ++n) {
    world.step();
    Pairs now;
    for (const Contact& c : world.contacts()) ++now[std::minmax(c.a.index, c.b.index)];
    std::pair<std::uint32_t, std::uint32_t> last{0, 0};
    std::size_t touching = 0;
    for (const ContactEvent& e : world.contact_events()) {
      const std::pair pair{e.a.index, e.b.index};
      ASSERT_LT(last, pair);
      last = pair;
      ASSERT_EQ(e.phase != ContactPhase::begin, before.contains(pair));
      ASSERT_EQ(e.phase != ContactPhase::end, now.contains(pair));
      ASSERT_EQ(e.contacts, (e.phase == ContactPhase::end ? before : now)[pair]);
      begun += e.phase == ContactPhase::begin;
      ended += e.phase == ContactPhase::end;
      touching += e.phase != ContactPhase::end;
    }
    ASSERT_EQ(touching, now.size());
    before = now;
  }
  EXPECT_GT(begun, 40u);
  EXPECT_GT(ended, 10u);
}

/// A random change between two steps, but for the first three bodies.
void change_randomly(World* world, Random random) {
  const auto any = [&] { return world->bodies()[3 + random.below(world->bodies().size() - 3)]; };
  switch (random.below(9)) {
    case 0:
      return world->remove(any());
    case 1:
      return void(world->add(test::random_body(&random, 2)));
    case 2:
      world->remove(any());
      return void(world->add(test::random_body(&random, 2)));
    case 3:
      return world->set_friction(any(), random.uniform(0, 1));
    case 4:
      return world->set_restitution(any(), random.uniform(0, 1));
    case 5:
      return world->set_state(any(), world->state(any()));
    case 6:
      return world->set_filter(any(), {.category = 2});
    case 7:
      return world->restore(world->snapshot());
    default:
      return;
  }
}

// The lists of contacts are made when they are needed.
TEST_P(ContactEvents, AndContactsAreTheSameWheneverTheyAreAskedFor) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  std::size_t compared = 0;
  for (int scene_number = 0; scene_number < 10; ++scene_number) {
    Scene scene = test::empty_scene();
    for (int i = 0; i < 40; ++i) {
      scene.bodies.push_back(i % 2 == 0 ? test::ball(random.uniform_in_box({-2, -2, -2}, {2, 2, 2}))
                                        : test::random_body(&random, 2));
      scene.bodies.back().sensor = random.below(8) == 0;
    }
    World always(scene), seldom(scene);
    if (scene_number % 3 == 0) {
      for (World* world : {&always, &seldom}) {
        world->add_contact_generator([](ContactContext& context) {
          context.add({.a = {0, 0}, .b = {2, 0}, .normal = {1, 0, 0}});
        });
      }
    }
    for (int n = 0; n < 30; ++n) {
      for (World* world : {&always, &seldom}) world->step();
      const auto contacts = always.contacts();
      const std::vector<Contact> expected(contacts.begin(), contacts.end());
      const bool is_change = random.below(2) == 0;
      (void)always.contact_events();
      if (is_change) {
        const Random same = random;
        for (World* world : {&always, &seldom}) change_randomly(world, same);
        random.below(2);
      }
      if (random.below(2) != 0) continue;
      ASSERT_TRUE(std::ranges::equal(always.contact_events(), seldom.contact_events())) << n;
      ASSERT_TRUE(std::ranges::equal(always.contacts(), seldom.contacts())) << n;
      if (!is_change) {
        ASSERT_TRUE(std::ranges::equal(expected, seldom.contacts())) << n;
      }
      compared += seldom.contacts().size() + seldom.contact_events().size();
    }
    ASSERT_EQ(always.state_hash(), seldom.state_hash());
  }
  EXPECT_GT(compared, 1000u);
}

}  // namespace
}  // namespace jfpx
