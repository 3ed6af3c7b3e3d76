/// Tests of collision filters and ignored pairs: definition, changes, waking, removal, errors.
#include <jfpx/error.hpp>

#include "tests/world/random_bodies.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace jfpx {
namespace {

using test::operator""_r;
using test::heavy;

using Pair = std::pair<std::uint32_t, std::uint32_t>;

std::set<Pair> pairs_of(std::span<const Contact> contacts) {
  std::set<Pair> pairs;
  for (const Contact& c : contacts) pairs.insert(std::minmax(c.a.index, c.b.index));
  return pairs;
}

/// Three balls in a row, each of which touches the next.
Scene three_balls() {
  Scene scene;
  scene.bodies = {test::ball({0, 0, 0}), test::ball({1.9_r, 0, 0}), test::ball({3.8_r, 0, 0})};
  return scene;
}

constexpr std::uint32_t kLower = 8;  ///< category of the lower ball

/// A stack of two balls on the ground, asleep.
World sleeping_stack(Solver solver) {
  Scene scene;
  scene.solver = solver;
  scene.bodies = {heavy({0, 0.995_r, 0}), heavy({0, 2.99_r, 0}), test::ground()};
  scene.bodies[0].filter = {.category = kLower};
  World world(scene);
  for (int n = 0; n < 200; ++n) world.step();
  return world;
}

TEST(CollisionFilter, NeedsACategoryInTheMaskOfTheOtherBothWays) {
  EXPECT_TRUE(may_collide({}, {}));
  EXPECT_TRUE(may_collide({.category = 2, .mask = 4}, {.category = 12, .mask = 3}));
  EXPECT_FALSE(may_collide({.category = 2, .mask = 4}, {.category = 12, .mask = 1}));
  EXPECT_FALSE(may_collide({.category = 12, .mask = 1}, {.category = 2, .mask = 4}));
  EXPECT_FALSE(may_collide({.category = 0}, {}));
  EXPECT_FALSE(may_collide({.mask = 0}, {}));
  EXPECT_TRUE(may_collide({.category = 0x80000000u}, {.mask = 0x80000000u}));

  Scene scene = three_balls();
  scene.bodies[0].filter = {.category = 2, .mask = 4};
  scene.bodies[1].filter = {.category = 4, .mask = 2};
  World world(scene);
  world.step();
  EXPECT_EQ(pairs_of(world.contacts()), (std::set<Pair>{{0, 1}}));
}

TEST(CollisionFilter, AppliesToEveryKindOfShape) {
  const Shape compound = centred(Compound{
      {{.shape = Sphere{1}, .position = {1, 0, 0}}, {.shape = Box{}, .position = {-1, 0, 0}}}});
  for (const Shape& first : {Shape(Sphere{1}), Shape(Box{}), compound}) {
    for (const Shape& second :
         {Shape(Sphere{1}), Shape(Box{}), compound, Shape(HalfSpace{}), Shape(Plane{})}) {
      const bool wall =
          second.index() == Shape(HalfSpace{}).index() || second.index() == Shape(Plane{}).index();
      for (const bool movable : {true, false}) {
        if (wall && movable) continue;
        Scene scene;
        scene.bodies = {test::ball({0.1_r, 0.2_r, 0}), test::ball({0, 0, 0})};
        scene.bodies[0].shape = first;
        scene.bodies[1].shape = second;
        if (!movable) scene.bodies[1].mass = 0;
        EXPECT_GT(World(scene).step().contacts, 0u);
        Scene filtered = scene;
        filtered.bodies[1].filter = {.category = 2};
        filtered.bodies[0].filter = {.mask = ~2u};
        EXPECT_EQ(World(filtered).step().contacts, 0u);
        scene.ignored_pairs = {{1, 0}};
        EXPECT_EQ(World(scene).step().contacts, 0u);
      }
    }
  }
}

TEST(CollisionFilter, AFallingBodyPassesThroughABodyThatItIgnores) {
  for (const Solver solver : test::kSolvers) {
    SCOPED_TRACE(to_string(solver));
    Scene scene;
    scene.solver = solver;
    scene.bodies = {heavy({0, 1.5_r, 0}), heavy({9, 1.5_r, 0}), test::ground()};
    scene.bodies[0].filter.mask = 2;
    World world(scene);
    for (int n = 0; n < 120; ++n) {
      world.step();
      for (const ContactEvent& event : world.contact_events()) {
        EXPECT_EQ(event.a, world.bodies()[1]);
        EXPECT_EQ(event.b, world.bodies()[2]);
      }
    }
    // A free fall: a parabola, or a sum of steps.
    const double fallen =
        solver == Solver::soft_step ? 9.81 * 2 * 2 / 2 : 9.81 / 3600 * 120 * 121 / 2;
    EXPECT_NEAR(world.states()[0].position.y, 1.5 - fallen, 1e-3);
    EXPECT_NEAR(world.states()[1].position.y, 1, 0.011);
  }
}

TEST(CollisionFilter, AChangeTakesEffectInTheNextStepAndEndsTheContact) {
  World world(three_balls());
  const BodyId middle = world.bodies()[1];
  world.step();
  EXPECT_EQ(pairs_of(world.contacts()), (std::set<Pair>{{0, 1}, {1, 2}}));
  world.set_filter(middle, {.category = 2, .mask = 2});
  EXPECT_EQ(world.filter(middle), (CollisionFilter{.category = 2, .mask = 2}));
  EXPECT_EQ(world.contacts().size(), 2u) << "the contacts of the last step remain readable";
  world.step();
  EXPECT_TRUE(world.contacts().empty());
  ASSERT_EQ(world.contact_events().size(), 2u);
  for (const ContactEvent& event : world.contact_events()) {
    EXPECT_EQ(event.phase, ContactPhase::end);
  }
  world.set_filter(middle, {});
  world.step();
  EXPECT_EQ(pairs_of(world.contacts()), (std::set<Pair>{{0, 1}, {1, 2}}));
  EXPECT_EQ(world.contact_events()[0].phase, ContactPhase::begin);
}

TEST(CollisionFilter, AChangeWakesTheBodyAndThoseInContact) {
  for (const Solver solver : test::kSolvers) {
    SCOPED_TRACE(to_string(solver));
    const auto expect_fall = [solver](const auto& change, bool lower_falls) {
      World world = sleeping_stack(solver);
      const BodyId lower = world.bodies()[0], upper = world.bodies()[1];
      ASSERT_FALSE(world.awake(lower) || world.awake(upper));
      change(world);
      for (int n = 0; n < 90; ++n) world.step();
      EXPECT_LT(world.state(upper).position.y, 2);
      EXPECT_EQ(world.state(lower).position.y < 0.9_r, lower_falls);
    };
    // The upper ball falls to the ground, through the lower one.
    expect_fall([](World& w) { w.set_filter(w.bodies()[1], {.mask = ~kLower}); }, false);
    expect_fall([](World& w) { w.set_pair_ignored(w.bodies()[0], w.bodies()[1], true); }, false);
    // The ground lets both fall.
    expect_fall([](World& w) { w.set_filter(w.bodies()[2], {.category = 0}); }, true);
    expect_fall(
        [](World& w) {
          w.set_pair_ignored(w.bodies()[2], w.bodies()[0], true);
          w.set_pair_ignored(w.bodies()[2], w.bodies()[1], true);
        },
        true);
  }
}

TEST(CollisionFilter, TheSameValueAgainWakesNothing) {
  for (const Solver solver : test::kSolvers) {
    SCOPED_TRACE(to_string(solver));
    World world = sleeping_stack(solver);
    const BodyId lower = world.bodies()[0], upper = world.bodies()[1];
    world.set_filter(lower, world.filter(lower));
    world.set_pair_ignored(lower, upper, false);
    EXPECT_FALSE(world.awake(lower) || world.awake(upper));
  }
}

TEST(CollisionFilter, DoesNotSpreadWakingThroughPairsThatDoNotCollide) {
  for (const Solver solver : test::kSolvers) {
    SCOPED_TRACE(to_string(solver));
    Scene scene;
    scene.solver = solver;
    scene.bodies = {heavy({0, 0.995_r, 0}), heavy({1.5_r, 0.995_r, 0}), test::ground()};
    scene.ignored_pairs = {{0, 1}};
    World world(scene);
    for (int n = 0; n < 200; ++n) world.step();
    const BodyId first = world.bodies()[0], second = world.bodies()[1];
    ASSERT_FALSE(world.awake(first) || world.awake(second));
    world.wake(first);
    world.step();
    EXPECT_TRUE(world.awake(first));
    EXPECT_FALSE(world.awake(second));
  }
}

TEST(IgnoredPairs, OfASceneMayBeListedTwiceAndInEitherOrder) {
  Scene scene = three_balls();
  scene.ignored_pairs = {{1, 0}, {0, 1}, {1, 0}};
  World world(scene);
  const BodyId a = world.bodies()[0], b = world.bodies()[1], c = world.bodies()[2];
  EXPECT_TRUE(world.pair_ignored(a, b));
  EXPECT_TRUE(world.pair_ignored(b, a));
  EXPECT_FALSE(world.pair_ignored(b, c));
  world.step();
  EXPECT_EQ(pairs_of(world.contacts()), (std::set<Pair>{{1, 2}}));
  world.set_pair_ignored(a, b, false);
  EXPECT_FALSE(world.pair_ignored(b, a));
  world.step();
  EXPECT_EQ(pairs_of(world.contacts()), (std::set<Pair>{{0, 1}, {1, 2}}));
}

TEST(IgnoredPairs, EndWithTheRemovalOfABody) {
  Scene scene = three_balls();
  scene.ignored_pairs = {{0, 1}, {1, 2}};
  World world(scene);
  const BodyId first = world.bodies()[0], old = world.bodies()[1], last = world.bodies()[2];
  world.remove(old);
  BodyDef def = test::ball({1.9_r, 0, 0});
  const BodyId fresh = world.add(def);
  ASSERT_EQ(fresh.index, old.index);
  EXPECT_FALSE(world.pair_ignored(first, fresh));
  EXPECT_FALSE(world.pair_ignored(fresh, last));
  world.step();
  EXPECT_EQ(pairs_of(world.contacts()), (std::set<Pair>{{0, 1}, {1, 2}}));

  // The filter does not pass to a new body either.
  world.set_filter(fresh, {.category = 0, .mask = 0});
  world.remove(fresh);
  const BodyId next = world.add(def);
  ASSERT_EQ(next.index, old.index);
  EXPECT_EQ(world.filter(next), CollisionFilter{});
  world.step();
  EXPECT_EQ(world.contacts().size(), 2u);
}

TEST(IgnoredPairs, OfUnknownBodiesOrOfOneBodyAreErrors) {
  World world(three_balls());
  const BodyId a = world.bodies()[0], gone = world.bodies()[1];
  world.remove(gone);
  EXPECT_THROW(world.filter(gone), InvalidArgument);
  EXPECT_THROW(world.set_filter(gone, {}), InvalidArgument);
  EXPECT_THROW(world.pair_ignored(a, gone), InvalidArgument);
  EXPECT_THROW(world.set_pair_ignored(gone, a, true), InvalidArgument);
  EXPECT_THROW(world.set_pair_ignored(a, {}, true), InvalidArgument);
  EXPECT_FALSE(world.pair_ignored(a, a));
  try {
    world.set_pair_ignored(a, a, true);
    ADD_FAILURE() << "no error";
  } catch (const InvalidArgument& error) {
    EXPECT_STREQ(error.what(), "pair is (0, 0); it must be of two different bodies");
  }
}

CollisionFilter random_filter(Random* random) {
  const auto bits = [random] {
    return static_cast<std::uint32_t>(random->below(8)) << (random->below(2) == 0 ? 0 : 29);
  };
  return random->below(3) == 0 ? CollisionFilter{} : CollisionFilter{bits(), ~bits()};
}

/// The contacts of each step are those of the same bodies without filters, in the same order,
/// without the pairs that a plain model excludes. Poses are equal because each step starts from the
/// states of the filtered world and velocities are 0.
TEST(CollisionFilter, LeavesOutExactlyTheExcludedPairsInRandomWorlds) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  std::uint64_t kept = 0, excluded = 0;
  for (int round = 0; round < 24; ++round) {
    Scene scene;
    for (int i = 0; i < 40; ++i) {
      BodyDef def = test::random_body(&random, 2);
      def.acceleration = {};
      def.filter = random_filter(&random);
      scene.bodies.push_back(def);
    }
    std::set<Pair> ignored;
    for (int i = 0; i < 60; ++i) {
      const auto a = static_cast<std::uint32_t>(random.below(40));
      const auto b = static_cast<std::uint32_t>(random.below(40));
      if (a == b) continue;
      scene.ignored_pairs.push_back({a, b});
      ignored.insert(std::minmax(a, b));
    }
    Scene plain = scene;
    plain.ignored_pairs.clear();
    for (BodyDef& def : plain.bodies) def.filter = {};
    World all(plain);
    all.step();
    // Which bodies meet during the step depends on those that they collide with.
    const auto touches = [](const Contact& c) { return c.distance < 0; };
    std::vector<Contact> expected;
    for (const Contact& c : all.contacts()) {
      if (!touches(c)) continue;
      const CollisionFilter f = scene.bodies[c.a.index].filter, g = scene.bodies[c.b.index].filter;
      const bool collides = (f.category & g.mask) != 0 && (g.category & f.mask) != 0 &&
                            !ignored.contains(std::minmax(c.a.index, c.b.index));
      if (collides) expected.push_back(c);
      ++(collides ? kept : excluded);
    }
    for (const BroadPhase way :
         {BroadPhase::cells, BroadPhase::hierarchy, BroadPhase::brute_force}) {
      World world(scene, {.collider = {}, .broad_phase = way});
      world.step();
      std::vector<Contact> found;
      std::ranges::copy_if(world.contacts(), std::back_inserter(found), touches);
      ASSERT_EQ(found, expected) << static_cast<int>(way);
      std::map<Pair, std::uint32_t> points;
      for (const Contact& c : world.contacts()) ++points[std::minmax(c.a.index, c.b.index)];
      ASSERT_EQ(world.contact_events().size(), points.size());
      for (const ContactEvent& e : world.contact_events()) {
        ASSERT_EQ(e.contacts, (points[{e.a.index, e.b.index}]));
      }
    }
  }
  EXPECT_GT(kept, 500u);
  EXPECT_GT(excluded, 500u);
}

}  // namespace
}  // namespace jfpx
