/// Tests of contact generators that change detected contacts before they are solved.
#include <jfpx/error.hpp>
#include <jfpx/snapshot.hpp>

#include "tests/world/random_changes.hpp"
#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace jfpx {
namespace {

using test::operator""_r;

JFPX_SOLVER_SUITE(ContactChanges);
JFPX_SOFT_STEP_SUITE(ContactChangesOfSolids);

BodyDef box(const Vec3& position, const Vec3& half_extents, Real mass = 1) {
  BodyDef def;
  def.shape = Box{half_extents};
  def.mass = mass;
  def.position = position;
  def.can_sleep = false;
  return def;
}

/// Ignores the contacts with a platform of bodies that rise, or whose lowest point is below its
/// top. The classical one-way platform of games.
struct OneWay {
  BodyId platform;
  Real top = 0, radius = 0;

  void operator()(ContactContext& context) const {
    for (DetectedContact& contact : context.detected()) {
      if (contact.a != platform && contact.b != platform) continue;
      const BodyState body = context.state(contact.a == platform ? contact.b : contact.a);
      contact.ignored = body.velocity.y > 0.1_r || body.position.y - radius < top - 0.05_r;
    }
  }
};

/// A platform of 20 cm whose top is at y = 2 m, and a ball that is thrown up from below.
World world_with_platform(Real speed, bool is_there = true) {
  BodyDef ball = test::ball({0, -1, 0}, 0.25_r);
  ball.acceleration = {0, -9.81_r, 0};
  ball.velocity = {0, speed, 0};
  std::vector<BodyDef> bodies{ball};
  if (is_there) bodies.push_back(box({0, 1.9_r, 0}, {3, 0.1_r, 3}, 0));
  return test::world_with(std::move(bodies));
}

TEST_P(ContactChangesOfSolids, MakeAOneWayPlatform) {
  // With 60 m/s, the ball passes the platform within one step.
  for (const Real speed : {9.0_r, 60.0_r}) {
    World world = world_with_platform(speed), free = world_with_platform(speed, false);
    World solid = world_with_platform(speed);
    const BodyId ball = world.bodies()[0], platform = world.bodies()[1];
    world.add_contact_generator(OneWay{platform, 2, 0.25_r});
    bool is_free = true;
    Real highest = 0;
    for (int n = 0; n < 900; ++n) {
      world.step();
      free.step();
      solid.step();
      highest = std::max(highest, world.state(ball).position.y);
      if (is_free && !world.contacts().empty()) is_free = false;
      if (is_free) ASSERT_EQ(world.state(ball), free.state(ball)) << n;
      ASSERT_LT(solid.state(ball).position.y, 1.8_r) << n;
    }
    EXPECT_FALSE(is_free);
    EXPECT_NEAR(highest, -1 + speed * speed / (2 * 9.81), 0.05 * speed);
    EXPECT_NEAR(world.state(ball).position.y, 2.25, 0.005);
    ASSERT_EQ(world.contact_events().size(), 1u);
    EXPECT_EQ(world.contact_events()[0].phase, ContactPhase::stay);
  }
}

/// Slides boxes over a floor at 4 m/s, and returns their speeds along x after 0.5 s.
/// @param material returns the friction of a contact
std::vector<double> speeds_after_sliding(
    std::vector<BodyDef> bodies, const std::function<Real(const DetectedContact&)>& friction) {
  for (BodyDef& body : bodies) {
    if (body.mass > 0) body.velocity = {4, 0, 0};
  }
  World world = test::world_with(std::move(bodies));
  world.add_contact_generator([friction](ContactContext& context) {
    for (DetectedContact& contact : context.detected()) contact.friction = friction(contact);
  });
  for (int n = 0; n < 30; ++n) {
    world.step();
    for (const Contact& contact : world.contacts()) {
      EXPECT_EQ(contact.friction, contact.point.z > 0 ? 0.6_r : 0.1_r);
      EXPECT_FALSE(contact.sensor);
    }
  }
  std::vector<double> speeds;
  for (const BodyState& state : world.states()) {
    speeds.push_back(static_cast<double>(state.velocity.x));
  }
  return speeds;
}

/// Two flat boxes, one on each side of the plane z = 0.
std::vector<BodyDef> two_sliding_boxes() {
  return {box({0, 0.1_r, -2}, {0.5_r, 0.1_r, 0.5_r}), box({0, 0.1_r, 2}, {0.5_r, 0.1_r, 0.5_r})};
}

TEST_P(ContactChangesOfSolids, GiveTrianglesAMaterial) {
  // A floor whose triangles are ice for z < 0 and asphalt for z > 0.
  TriangleMeshDef def;
  for (int z = -1; z <= 1; ++z) {
    for (int x = 0; x <= 5; ++x) {
      def.vertices.push_back({static_cast<Real>(4 * x - 8), 0, static_cast<Real>(6 * z)});
    }
  }
  for (std::uint32_t row = 0; row < 2; ++row) {
    for (std::uint32_t x = 0; x < 5; ++x) {
      const std::uint32_t n = 6 * row + x;
      def.triangles.push_back({n, n + 6, n + 1});
      def.triangles.push_back({n + 1, n + 6, n + 7});
    }
  }
  std::vector<BodyDef> bodies = two_sliding_boxes();
  bodies.emplace_back().shape = TriangleMesh(def);
  bodies.back().mass = 0;
  const auto friction = [](const DetectedContact& contact) {
    return contact.part_b < 10 ? 0.1_r : 0.6_r;
  };
  const std::vector<double> speeds = speeds_after_sliding(bodies, friction);
  EXPECT_NEAR(speeds[0], 4 - 0.1 * test::kG * 0.5, 0.02);
  EXPECT_NEAR(speeds[1], 4 - 0.6 * test::kG * 0.5, 0.05);
}

TEST_P(ContactChangesOfSolids, GivePartsOfACompoundAMaterial) {
  std::vector<BodyDef> bodies = two_sliding_boxes();
  CompoundPart left{Box{{8, 0.5_r, 3}}}, right = left;
  left.position = {0, -0.5_r, -3};
  right.position = {0, -0.5_r, 3};
  bodies.emplace_back().shape = Compound{{left, right}};
  bodies.back().mass = 0;
  const auto friction = [](const DetectedContact& contact) {
    return contact.part_b == 0 ? 0.1_r : 0.6_r;
  };
  const std::vector<double> speeds = speeds_after_sliding(bodies, friction);
  EXPECT_NEAR(speeds[0], 4 - 0.1 * test::kG * 0.5, 0.02);
  EXPECT_NEAR(speeds[1], 4 - 0.6 * test::kG * 0.5, 0.05);
}

TEST_P(ContactChanges, OfTheRestitutionOfTwoBallsDecideAboutTheirRebound) {
  BodyDef left = test::ball({-3, 0, 0}), right = test::ball({3, 0, 0});
  left.velocity = {2, 0, 0};
  right.velocity = {-2, 0, 0};
  World world = test::world_with({left, right});
  const std::vector<BodyId> ids(world.bodies().begin(), world.bodies().end());
  world.add_contact_generator([](ContactContext& context) {
    for (DetectedContact& contact : context.detected()) contact.restitution = 0.5_r;
  });
  bool touched = false;
  for (int n = 0; n < 120; ++n) {
    world.step();
    for (const Contact& contact : world.contacts()) {
      EXPECT_EQ(contact.restitution, 0.5_r);
      EXPECT_EQ(contact.friction, 0);
      touched = true;
    }
  }
  EXPECT_TRUE(touched);
  EXPECT_NEAR(world.state(ids[0]).velocity.x, -1, 0.01);
  EXPECT_NEAR(world.state(ids[1]).velocity.x, 1, 0.01);
}

TEST_P(ContactChanges, OfIgnoredContactsLeaveBodiesFree) {
  BodyDef sleeping = test::heavy({0, 1, 0});
  World world(test::on_the_ground({sleeping, test::ball({0, 4, 0}), test::ball({4, 1, 0})}));
  const std::vector<BodyId> ids(world.bodies().begin(), world.bodies().end());
  const ContactGeneratorId id = world.add_contact_generator([&ids](ContactContext& context) {
    for (DetectedContact& contact : context.detected()) {
      contact.ignored = contact.a == ids[1] || contact.b == ids[1];
    }
  });
  for (int n = 0; n < 300 && world.awake(ids[0]); ++n) world.step();
  ASSERT_FALSE(world.awake(ids[0]));
  world.set_state(ids[1], {{0, 4, 0}, {}, {0, -2, 0}, {}});  // through the ball and the floor
  for (int n = 0; n < 240; ++n) {
    const StepReport report = world.step();
    ASSERT_EQ(report.contacts, world.contacts().size());
    for (const Contact& contact : world.contacts()) ASSERT_NE(contact.a, ids[1]);
    for (const ContactEvent& event : world.contact_events()) ASSERT_NE(event.a, ids[1]);
  }
  EXPECT_FALSE(world.awake(ids[0]));
  EXPECT_NEAR(world.state(ids[1]).position.y, -4, 1e-3);
  EXPECT_EQ(world.state(ids[1]).velocity, (Vec3{0, -2, 0}));
  EXPECT_EQ(world.state(ids[2]).position, (Vec3{4, 1, 0}));
  world.remove_contact_generator(id);
}

TEST_P(ContactChanges, AreChecked) {
  const auto complaint = [](const std::function<void(DetectedContact*)>& change) {
    World world(test::on_the_ground({test::heavy({0, 0.99_r, 0})}));
    world.add_contact_generator([change](ContactContext& context) {
      for (DetectedContact& contact : context.detected()) change(&contact);
    });
    const std::vector<BodyState> before = world.states();
    try {
      world.step();
    } catch (const InvalidArgument& error) {
      EXPECT_EQ(world.states(), before);
      EXPECT_EQ(world.steps(), 0u);
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(complaint([](DetectedContact* c) { c->friction = -1; }),
            "detected contact: friction is -1; it must be finite and >= 0");
  EXPECT_EQ(complaint([](DetectedContact* c) { c->restitution = 1.5_r; }),
            "detected contact: restitution is 1.5; it must be in [0, 1]");
  EXPECT_NE(complaint([](DetectedContact* c) { c->friction = test::kNan; }), "");
  EXPECT_EQ(complaint([](DetectedContact* c) { c->friction = 3; }), "");
}

std::vector<Contact> contacts_of(const World& world) {
  return {world.contacts().begin(), world.contacts().end()};
}

/// Changes a part of the contacts of a random world, by numbers that depend on the bodies only.
void change_some(ContactContext& context) {
  for (DetectedContact& contact : context.detected()) {
    const std::uint32_t number = contact.a.index * 7 + contact.b.index * 3 + contact.part_b;
    if (number % 5 == 0) contact.friction = 0.9_r;
    if (number % 7 == 0) contact.restitution = 0.7_r;
    if (number % 11 == 0) contact.ignored = true;
  }
}

// A list without changes has no effect; with changes, bits do not depend on threads or snapshots.
TEST_P(ContactChangesOfSolids, OfRandomWorldsHaveTheSameBits) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  for (std::uint64_t run = 0; run < 4; ++run) {
    Random random(seed + run);
    const Scene scene = test::random_room(&random);
    World plain(scene), listed(scene);
    listed.add_contact_generator([](ContactContext& context) { context.detected(); });
    WorldSettings threads;
    threads.threads = 3;
    World changed(scene), parallel(scene, threads);
    for (World* world : {&changed, &parallel}) world->add_contact_generator(change_some);
    bool any_ignored = false;
    for (int n = 0; n < 60; ++n) {
      const std::size_t all = plain.step().contacts;
      listed.step();
      ASSERT_EQ(listed.states(), plain.states()) << n;
      ASSERT_EQ(contacts_of(listed), contacts_of(plain)) << n;
      const StepReport report = changed.step();
      ASSERT_EQ(report.contacts, changed.contacts().size()) << n;
      any_ignored |= n == 0 && report.contacts < all;
      parallel.step();
      ASSERT_EQ(changed.states(), parallel.states()) << n;
      ASSERT_EQ(contacts_of(changed), contacts_of(parallel)) << n;
      if (n == 30) parallel.restore(changed.snapshot());
    }
  }
}

}  // namespace
}  // namespace jfpx
