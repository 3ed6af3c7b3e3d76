/// Tests of contact generators: ropes, rods and errors.
#include <jfpx/error.hpp>

#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace jfpx {
namespace {

using test::operator""_r;

/// A user-defined contact generator: a rope between points of two bodies, whose ends cannot
/// separate further when it is taut.
struct Rope {
  BodyId a, b;
  Real length = 1;
  Vec3 point_a = {}, point_b = {};  ///< body axes

  void operator()(ContactContext& context) const {
    const Vec3 end_a = to_world_point(context.state(a), point_a);
    const Vec3 d = to_world_point(context.state(b), point_b) - end_a;
    const Real now = jfpx::length(d);
    if (now < length) return;
    context.add(
        {.a = a, .b = b, .normal = d * (1 / now), .point = end_a, .distance = length - now});
  }
};

/// A rod: keeps two centres at a constant distance. The soft step needs both of its contacts,
/// because it calls contact generators before bodies move.
struct Rod {
  BodyId a, b;
  Real length = 1;
  bool both = false;

  void operator()(ContactContext& context) const {
    const Vec3 from = context.state(a).position, d = context.state(b).position - from;
    const Real now = jfpx::length(d);
    const Vec3 pull = d * (1 / now);
    const Real excess = now - length;
    const auto add = [&](const Vec3& normal, Real gap) {
      if (!both && gap > 0) return;
      const Real distance = std::min(gap, Real(0));
      context.add({.a = a, .b = b, .normal = normal, .point = from, .distance = distance});
    };
    add(pull, -excess);
    if (both || excess != 0) add(-pull, excess);
  }
};

JFPX_SOLVER_SUITE(ContactGenerator);

BodyDef weight(const Vec3& position) {
  BodyDef def = test::ball(position, 0.1_r);
  def.acceleration = {0, -9.81_r, 0};
  return def;
}
BodyDef nail() { return test::ball({0, 0, 0}, 0.1_r, 0); }

/// An immovable body at the origin, and the given bodies.
World world_with_nail(std::vector<BodyDef> bodies, Real dt = 0.002_r) {
  Scene scene = test::empty_scene();
  scene.dt = dt;
  scene.bodies = std::move(bodies);
  scene.bodies.insert(scene.bodies.begin(), nail());
  scene.resolver.position_epsilon = 1e-3_r;
  scene.resolver.velocity_epsilon = 1e-3_r;
  return World(scene);
}

TEST_P(ContactGenerator, ABallOnARopeSwingsAsAPendulum) {
  const Real start = 0.1_r;  // rad
  World world = world_with_nail({weight({2 * start, -2 * std::sqrt(1 - start * start), 0})});
  world.add_contact_generator(Rope{world.bodies()[0], world.bodies()[1], 2});
  const double period = 2 * 3.14159265358979 * std::sqrt(2 / 9.81);
  double crossing = 0;
  Real last = start;
  for (int n = 1; n <= 1000; ++n) {
    ASSERT_FALSE(world.step().non_finite);
    const BodyState s = world.states()[1];
    ASSERT_LT(length(s.position), 2.002_r) << n;
    if (crossing == 0 && last > 0 && s.position.x <= 0) crossing = n * 0.002;
    last = s.position.x;
  }
  EXPECT_NEAR(crossing, period / 4, 0.02 * period);
}

TEST_P(ContactGenerator, ASlackRopeHasNoEffect) {
  World world = world_with_nail({weight({0, -1, 0})});
  World free = world_with_nail({weight({0, -1, 0})});
  world.add_contact_generator(Rope{world.bodies()[0], world.bodies()[1], 2});
  // A fall of 1 m takes 0.45 s.
  for (int n = 0; n < 220; ++n) {
    ASSERT_EQ(world.step().generated_contacts, 0u);
    free.step();
  }
  EXPECT_EQ(world.states(), free.states());
  StepReport report;
  for (int n = 0; n < 20; ++n) report = world.step();
  EXPECT_EQ(report.generated_contacts, 1u);
  EXPECT_EQ(report.contacts, 0u);
  EXPECT_EQ(world.contacts().size(), 1u);
  EXPECT_TRUE(world.contact_events().empty());
  EXPECT_NEAR(world.states()[1].velocity.y, 0, 0.01);
}

TEST_P(ContactGenerator, ARopeBetweenPointsOfBodiesKeepsTheMomenta) {
  BodyDef a = test::ball({-1, 0, 0}, 0.5_r, 2), b = test::ball({1, 0, 0}, 0.5_r, 3);
  a.velocity = {-1, 0.5_r, 0.2_r};
  b.velocity = {2, -0.3_r, 0.1_r};
  b.angular_velocity = {1, 2, 3};
  World world = world_with_nail({a, b});
  world.remove(world.bodies()[0]);  // the immovable body
  const BodyId first = world.bodies()[0], second = world.bodies()[1];
  // Attached to the surfaces, off the line of centres, so that the rope rotates both bodies.
  world.add_contact_generator(Rope{first, second, 2.5_r, {0, 0.5_r, 0}, {0, 0, 0.5_r}});
  const auto now = [&] {
    const std::vector<BodyDef> defs = {a, b};
    const BodyState states[] = {world.state(first), world.state(second)};
    return test::sums(defs, states);
  };
  const test::Sums before = now();
  std::uint64_t pulls = 0;
  for (int n = 0; n < 1500; ++n) pulls += world.step().generated_contacts;
  EXPECT_GT(pulls, 10u);
  EXPECT_GT(length(world.state(first).angular_velocity), 0.1_r);
  const test::Sums after = now();
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(after.momentum[k], before.momentum[k], 1e-4 * before.scale);
    // Projections move bodies without momentum, by at most a little of the position epsilon.
    EXPECT_NEAR(after.angular_momentum[k], before.angular_momentum[k], 5e-3 * before.scale);
  }
  EXPECT_LE(after.energy, before.energy * 1.0001);
}

TEST_P(ContactGenerator, ARodPullsAndPushes) {
  BodyDef b = test::ball({1, 0, 0}, 0.1_r), c = test::ball({0, 2, 0}, 0.1_r);
  b.velocity = {-1, 3, 0};  // inwards: the rod must push
  c.velocity = {1, 4, 0};   // outwards: the rod must pull
  World world = world_with_nail({b, c});
  const bool both = GetParam() == Solver::soft_step;
  world.add_contact_generator(Rod{world.bodies()[0], world.bodies()[1], 1, both});
  world.add_contact_generator(Rod{world.bodies()[0], world.bodies()[2], 2, both});
  for (int n = 0; n < 1000; ++n) {
    ASSERT_EQ(world.step().generated_contacts, both ? 4u : 2u);
    ASSERT_NEAR(length(world.states()[1].position), 1, 2e-3) << n;
    ASSERT_NEAR(length(world.states()[2].position), 2, 2e-3) << n;
  }
  // The velocity along the rod is gone; the perpendicular component remains.
  EXPECT_NEAR(length(world.states()[1].velocity), 3, 0.1);
  EXPECT_NEAR(length(world.states()[2].velocity), 1, 0.1);
}

TEST_P(ContactGenerator, ActInTheOrderOfTheirAddition) {
  World world = world_with_nail({weight({0, -1, 0})});
  const BodyId a = world.bodies()[0], b = world.bodies()[1];
  const auto mark = [a, b](Real depth) {
    return [a, b, depth](ContactContext& context) {
      context.add({.a = a, .b = b, .normal = {0, 1, 0}, .distance = -depth});
    };
  };
  world.add_contact_generator(mark(0));
  const ContactGeneratorId second = world.add_contact_generator(mark(1e-4_r));
  world.add_contact_generator(mark(2e-4_r));
  const auto depths = [&world] {
    world.step();
    std::vector<Real> found;
    for (const Contact& c : world.contacts()) found.push_back(-c.distance);
    return found;
  };
  EXPECT_EQ(depths(), (std::vector<Real>{0, 1e-4_r, 2e-4_r}));
  world.remove_contact_generator(second);
  world.add_contact_generator(mark(3e-4_r));
  EXPECT_EQ(depths(), (std::vector<Real>{0, 2e-4_r, 3e-4_r}));
  EXPECT_EQ(world.contact_generators().size(), 3u);
}

TEST_P(ContactGenerator, AreRemovedOnceAndTheirIdsAreNeverReused) {
  World world = world_with_nail({weight({0, -2, 0})});
  const Rope rope{world.bodies()[0], world.bodies()[1], 2};
  const ContactGeneratorId first = world.add_contact_generator(rope);
  world.contact_generator<Rope>(first).length = 3;
  EXPECT_EQ(world.step().generated_contacts, 0u);
  EXPECT_THROW(world.contact_generator<Rod>(first), InvalidArgument);
  world.remove_contact_generator(first);
  EXPECT_THROW(world.remove_contact_generator(first), InvalidArgument);
  EXPECT_NE(world.add_contact_generator(rope), first);
  try {
    world.contact_generator<Rope>(first);
    ADD_FAILURE();
  } catch (const InvalidArgument& error) {
    EXPECT_STREQ(
        error.what(),
        "contact generator 0 is unknown; it must be one of this world that was not removed");
  }
}

TEST_P(ContactGenerator, ABodyHangingAtRestSleepsAndWakesWithTheOtherEnd) {
  BodyDef lower = weight({0, -2, 0}), upper = weight({0, -1, 0});
  lower.can_sleep = upper.can_sleep = true;
  World world = world_with_nail({upper, lower}, 0.01_r);
  const BodyId a = world.bodies()[0], b = world.bodies()[1], c = world.bodies()[2];
  world.add_contact_generator(Rope{a, b, 1});
  const ContactGeneratorId second = world.add_contact_generator(Rope{b, c, 1});
  for (int n = 0; n < 200; ++n) world.step();
  ASSERT_FALSE(world.awake(b) || world.awake(c));
  const auto resting = world.states();
  for (int n = 0; n < 100; ++n) world.step();
  EXPECT_EQ(world.states(), resting);
  for (int n = 0; n < 20; ++n) {
    world.apply_force(b, {20, 0, 0});
    world.step();
  }
  EXPECT_TRUE(world.awake(c));
  world.remove_contact_generator(second);  // cuts the rope
  for (int n = 0; n < 100; ++n) world.step();
  EXPECT_LT(world.state(c).position.y, -5);
}

TEST_P(ContactGenerator, ABadContactUndoesTheStepAndIsNamed) {
  World world = world_with_nail({weight({0, -2, 0})});
  const BodyId a = world.bodies()[0], b = world.bodies()[1];
  const GeneratedContact good{.a = a, .b = b, .normal = {0, 1, 0}};
  const auto said = [&](const GeneratedContact& contact) {
    const auto before = world.states();
    const ContactGeneratorId id =
        world.add_contact_generator([contact](ContactContext& context) { context.add(contact); });
    std::string text;
    try {
      world.step();
    } catch (const InvalidArgument& error) {
      text = error.what();
      EXPECT_EQ(world.states(), before);
      EXPECT_TRUE(world.contacts().empty());
    }
    world.remove_contact_generator(id);
    return text;
  };
  EXPECT_EQ(said(good), "");
  GeneratedContact bad = good;
  bad.normal = {0, 0, 0};
  EXPECT_EQ(said(bad),
            "generated contact: normal is (0, 0, 0); it must be a unit vector, to a thousandth");
  bad = good;
  bad.distance = 0.5_r;
  EXPECT_EQ(said(bad), "generated contact: distance is 0.5; it must be finite and <= 0");
  bad = good;
  bad.b = a;
  EXPECT_EQ(said(bad), "generated contact: a and b are one body; they must be two");
  bad.b = BodyId{};
  EXPECT_NE(said(bad), "");
  for (const Real x :
       {std::numeric_limits<Real>::quiet_NaN(), -std::numeric_limits<Real>::infinity(), Real(-1)}) {
    bad = good;
    bad.friction = x;
    EXPECT_NE(said(bad), "");
    bad = good;
    bad.restitution = x;
    EXPECT_NE(said(bad), "");
    if (is_finite(x)) continue;
    bad = good;
    bad.point.x = x;
    EXPECT_NE(said(bad), "");
    bad = good;
    bad.distance = x;
    EXPECT_NE(said(bad), "");
  }
}

TEST_P(ContactGenerator, BetweenBodiesOfMassZeroHasNoEffect) {
  World world = world_with_nail({test::ground()});
  world.add_contact_generator([](ContactContext& context) {
    context.add({.a = context.bodies()[0], .b = context.bodies()[1], .normal = {0, 1, 0}});
  });
  EXPECT_EQ(world.step().generated_contacts, 0u);
}

}  // namespace
}  // namespace jfpx
