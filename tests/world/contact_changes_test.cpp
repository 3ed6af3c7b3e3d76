/// Tests of contact generators that change detected contacts before they are solved.
#include <jfpx/error.hpp>
#include <jfpx/snapshot.hpp>

#include "tests/world/random_changes.hpp"
#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <utility>
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
      if (is_free) {
        ASSERT_EQ(world.state(ball), free.state(ball)) << n;
      }
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

TEST_P(ContactChanges, SetTheRestitutionOfTwoBalls) {
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

TEST_P(ContactChanges, IgnoreContacts) {
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

TEST_P(ContactChanges, OfLaterGeneratorsFollowThoseOfEarlierOnes) {
  World world(test::on_the_ground({test::heavy({0, 0.99_r, 0}), test::heavy({3, 0.99_r, 0})}));
  const BodyId first = world.bodies()[0], ground = world.bodies()[2];
  world.add_contact_generator([=](ContactContext& context) {
    context.add({.a = first, .b = ground, .normal = {1, 0, 0}, .distance = -0.01_r});
    for (DetectedContact& contact : context.detected()) {
      contact.friction = 0.25_r;
      contact.ignored = true;
    }
  });
  std::vector<Real> seen;
  world.add_contact_generator([&](ContactContext& context) {
    seen.clear();
    for (DetectedContact& contact : context.detected()) {
      seen.push_back(contact.friction);
      EXPECT_TRUE(contact.ignored);
      contact.ignored = contact.a == first || contact.b == first;
    }
  });
  const StepReport report = world.step();
  EXPECT_EQ(seen, (std::vector<Real>{0.25_r, 0.25_r}));
  EXPECT_EQ(report.contacts, 1u);
  EXPECT_EQ(report.generated_contacts, 1u);
  ASSERT_EQ(world.contacts().size(), 2u);
  EXPECT_EQ(world.contacts()[0].friction, 0.25_r);
  EXPECT_EQ(world.contacts()[1].normal, (Vec3{1, 0, 0}));
}

TEST_P(ContactChanges, AreUndoneByAnException) {
  const auto scene = test::on_the_ground({test::heavy({0, 0.99_r, 0}), test::heavy({0, 2.9_r, 0})});
  World world(scene), undisturbed(scene);
  for (World* w : {&world, &undisturbed}) w->step();
  const ContactGeneratorId id = world.add_contact_generator([](ContactContext& context) {
    for (DetectedContact& contact : context.detected()) contact.ignored = true;
    throw std::runtime_error("no");
  });
  EXPECT_THROW(world.step(), std::runtime_error);
  world.remove_contact_generator(id);
  for (int n = 0; n < 5; ++n) {
    world.step();
    undisturbed.step();
    ASSERT_EQ(world.states(), undisturbed.states());
  }
}

TEST_P(ContactChanges, StayWithTheirContactsWhenABodyIsRemoved) {
  World world(test::on_the_ground({test::heavy({0, 0.99_r, 0}), test::heavy({0, 2.9_r, 0}),
                                   test::heavy({5, 0.99_r, 0}), test::heavy({5, 2.9_r, 0})}));
  world.add_contact_generator([](ContactContext& context) {
    for (DetectedContact& contact : context.detected()) {
      contact.friction = 0.1_r * static_cast<Real>(contact.a.index + contact.b.index);
    }
  });
  const std::vector<BodyId> ids(world.bodies().begin(), world.bodies().end());
  world.step();
  world.remove(ids[0]);
  World copy(world.settings());
  copy.add_contact_generator([](ContactContext&) {});
  copy.restore(world.snapshot());
  world.step();
  bool any = false;
  for (const Contact& contact : world.contacts()) {
    EXPECT_EQ(contact.friction, 0.1_r * static_cast<Real>(contact.a.index + contact.b.index));
    any = true;
  }
  EXPECT_TRUE(any);
}

TEST_P(ContactChanges, FollowASnapshotWithAnotherSolver) {
  Scene scene = test::on_the_ground({test::heavy({0, 0.99_r, 0}), test::heavy({0, 2.9_r, 0})});
  scene.solver = Solver::soft_step;
  World soft(scene);
  scene.solver = Solver::worst_first;
  World other(scene);
  std::size_t listed = 0;
  for (World* world : {&soft, &other}) {
    world->add_contact_generator([&listed](ContactContext& context) {
      listed = context.detected().size();
      for (DetectedContact& contact : context.detected()) contact.friction = 0.1_r;
    });
    world->step();
  }
  World& from = GetParam() == Solver::soft_step ? soft : other;
  World& to = GetParam() == Solver::soft_step ? other : soft;
  to.restore(from.snapshot());
  for (int n = 0; n < 3; ++n) {
    from.step();
    to.step();
    ASSERT_EQ(to.states(), from.states());
    EXPECT_EQ(listed, 2u);
  }
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
  EXPECT_EQ(
      complaint([](DetectedContact* c) { std::swap(c->a, c->b); }),
      "detected contact: bodies or parts were changed; only friction, restitution and ignored "
      "may be");
  EXPECT_NE(complaint([](DetectedContact* c) { c->a = {}; }), "");
  EXPECT_EQ(complaint([](DetectedContact* c) { c->friction = 3; }), "");
}

std::vector<Contact> contacts_of(const World& world) {
  return {world.contacts().begin(), world.contacts().end()};
}

// The box covers the seam evenly: each part has half of the contact points.
TEST_P(ContactChangesOfSolids, ReachThePointsOfTheirPartAtASeam) {
  CompoundPart left{Box{{8, 0.5_r, 3}}}, right = left;
  left.position = {0, -0.5_r, -3};
  right.position = {0, -0.5_r, 3};
  BodyDef floor;
  floor.shape = Compound{{left, right}};
  floor.mass = 0;
  for (const int ignored_part : {-1, 0, 1}) {
    World world = test::world_with({box({0, 0.099_r, 0}, {0.5_r, 0.1_r, 0.5_r}), floor});
    world.add_contact_generator([=](ContactContext& context) {
      for (DetectedContact& contact : context.detected()) {
        contact.friction = contact.part_b == 0 ? 0.1_r : 0.6_r;
        contact.ignored = static_cast<int>(contact.part_b) == ignored_part;
      }
    });
    const StepReport report = world.step();
    ASSERT_EQ(report.contacts, world.contacts().size());
    int of_part[2] = {};
    for (const Contact& contact : world.contacts()) {
      ++of_part[contact.friction == 0.1_r ? 0 : 1];
      ASSERT_TRUE(contact.friction == 0.1_r ? contact.point.z < 0.01_r : contact.point.z > -0.01_r);
    }
    EXPECT_EQ(of_part[0], ignored_part == 0 ? 0 : 4);
    EXPECT_EQ(of_part[1], ignored_part == 1 ? 0 : 4);
  }
}

// A ball falls through an open trap door at the side of a floor, which still stops it.
TEST_P(ContactChangesOfSolids, OfATrapDoorLeaveTheFloorBesideItSolid) {
  const BodyDef floor = box({-5, -0.5_r, 0}, {5, 0.5_r, 5}, 0);
  const BodyDef door = box({5, -0.5_r, 0}, {5, 0.5_r, 5}, 0);
  BodyDef falling = box({0.2003_r, 0.15_r, 0}, {0.2_r, 0.2_r, 0.2_r});
  falling.friction = 0;
  falling.velocity = {-1, -1, 0};
  World world = test::world_with({floor, door, falling});
  const std::vector<BodyId> ids(world.bodies().begin(), world.bodies().end());
  world.add_contact_generator([&](ContactContext& context) {
    for (DetectedContact& contact : context.detected()) {
      contact.ignored = contact.a == ids[1] || contact.b == ids[1];
    }
  });
  for (int n = 0; n < 20; ++n) {
    world.step();
    ASSERT_GT(world.state(ids[2]).position.x, n == 0 ? 0.19_r : 0.17_r) << n;
    for (const Contact& contact : world.contacts()) ASSERT_NE(contact.b, ids[1]);
  }
  EXPECT_LT(world.state(ids[2]).position.y, -0.5_r);
}

// The numbers of triangles are those of the definitions, also beside holes.
TEST_P(ContactChangesOfSolids, KnowTheTrianglesOfSurfaces) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  HeightfieldDef def;
  def.columns = 9;
  def.rows = 7;
  def.spacing_x = 0.7_r;
  def.spacing_z = 0.9_r;
  for (int i = 0; i < 63; ++i) def.heights.push_back(random.uniform(-0.1_r, 0.1_r));
  def.holes = {12, 20, 31};
  const Heightfield field(def);
  TriangleMeshDef mesh;
  for (std::uint32_t n = 0; n < 63; ++n) mesh.vertices.push_back(field.vertex(n / 9, n % 9));
  for (std::uint32_t n = 0; n < 53; ++n) {
    if (n % 9 == 8) continue;
    mesh.triangles.push_back({n + 1, n + 9, n + 10});
    mesh.triangles.push_back({n, n + 9, n + 1});
  }
  for (const bool is_mesh : {false, true}) {
    Scene scene = test::empty_scene();
    scene.bodies.emplace_back().mass = 0;
    scene.bodies[0].shape = is_mesh ? Shape(TriangleMesh(mesh)) : Shape(field);
    for (int i = 0; i < 30; ++i) {
      scene.bodies.push_back(
          test::heavy(random.uniform_in_box({-2.5_r, 0.2_r, -2.5_r}, {2.5_r, 0.4_r, 2.5_r})));
      scene.bodies.back().shape = Sphere{0.2_r};
      scene.bodies.back().filter = {.category = 2, .mask = 1};
    }
    World world(scene);
    std::size_t tested = 0;
    world.add_contact_generator([&](ContactContext& context) {
      for (const DetectedContact& contact : context.detected()) {
        const std::uint32_t n = contact.part_b / 2, vertex = contact.part_b % 2 == 0 ? n : n + 10;
        const auto corners =
            is_mesh ? mesh.triangles[contact.part_b] : Triangle{vertex, n + 9, n + 1};
        const Vec3 a = mesh.vertices[corners[0]], b = mesh.vertices[corners[1]];
        const Vec3 c = mesh.vertices[corners[2]];
        Vec3 low = a, high = a;
        for (const Vec3& v : {b, c}) {
          low = {std::min(low.x, v.x), 0, std::min(low.z, v.z)};
          high = {std::max(high.x, v.x), 0, std::max(high.z, v.z)};
        }
        ASSERT_TRUE(contact.point.x > low.x - 0.1_r && contact.point.x < high.x + 0.1_r);
        ASSERT_TRUE(contact.point.z > low.z - 0.1_r && contact.point.z < high.z + 0.1_r);
        ++tested;
      }
    });
    for (int n = 0; n < 40; ++n) world.step();
    EXPECT_GT(tested, 300u);
  }
}

TEST_P(ContactChangesOfSolids, ActOnABallThatSlidesOverATriangle) {
  TriangleMeshDef def;
  def.vertices = {{-20, 0, -20}, {-20, 0, 40}, {40, 0, -20}};
  def.triangles = {{0, 1, 2}};
  BodyDef floor;
  floor.shape = TriangleMesh(def);
  floor.mass = 0;
  BodyDef ball = test::heavy({0, 0.5_r, 0});
  ball.shape = Sphere{0.5_r};
  ball.friction = 0.5_r;
  ball.velocity = {4, 0, 0};
  World world = test::world_with({floor, ball});
  world.add_contact_generator([](ContactContext& context) {
    for (DetectedContact& contact : context.detected()) contact.friction = 0.1_r;
  });
  for (int n = 0; n < 60; ++n) world.step();
  // It slides for (2 / 7) 4 m/s / (0.1 g) = 1.16 s.
  EXPECT_NEAR(world.states()[1].velocity.x, 4 - 0.1 * test::kG, 0.03);
}

/// Changes a part of the contacts of a random world, by numbers that depend on the bodies only.
struct ChangeSome {
  int* changed = nullptr;

  void operator()(ContactContext& context) const {
    for (DetectedContact& contact : context.detected()) {
      const std::uint32_t number = contact.a.index * 7 + contact.b.index * 3 + contact.part_b;
      if (number % 3 == 0) contact.friction = 0.9_r;
      if (number % 4 == 0) contact.restitution = 0.7_r;
      contact.ignored = number % 5 == 0;
      if (changed != nullptr && contact.ignored) ++*changed;
    }
  }
};

// A list without changes has no effect; with changes, bits do not depend on threads or snapshots.
TEST_P(ContactChangesOfSolids, OfRandomWorldsHaveTheSameBits) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  int ignored = 0, with_material = 0;
  const auto is_enough = [&](std::uint64_t runs) {
    return runs >= 50 || (runs >= 5 && ignored > 0 && with_material > 0);
  };
  for (std::uint64_t run = 0; !is_enough(run); ++run) {
    Random random(seed + run);
    const Scene scene = test::random_room(&random);
    World plain(scene), listed(scene);
    listed.add_contact_generator([](ContactContext& context) { context.detected(); });
    WorldSettings threads;
    threads.threads = 3;
    World changed(scene), parallel(scene, threads);
    changed.add_contact_generator(ChangeSome{&ignored});
    parallel.add_contact_generator(ChangeSome{});
    for (int n = 0; n < 30; ++n) {
      plain.step();
      listed.step();
      ASSERT_EQ(listed.states(), plain.states()) << n;
      ASSERT_EQ(contacts_of(listed), contacts_of(plain)) << n;
      const StepReport report = changed.step();
      ASSERT_EQ(report.contacts, changed.contacts().size()) << n;
      for (const Contact& contact : changed.contacts()) {
        with_material += !contact.sensor && contact.friction == 0.9_r ? 1 : 0;
      }
      parallel.step();
      ASSERT_EQ(changed.states(), parallel.states()) << n;
      ASSERT_EQ(contacts_of(changed), contacts_of(parallel)) << n;
      if (n % 10 != 0) continue;
      parallel.restore(changed.snapshot());
      ASSERT_EQ(contacts_of(changed), contacts_of(parallel)) << n;
    }
  }
  EXPECT_GT(ignored, 0);
  EXPECT_GT(with_material, 0);
}

TEST_P(ContactChangesOfSolids, HideIgnoredPairsFromAllLists) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  const auto is_ignored = [](BodyId a, BodyId b) { return (a.index + b.index) % 3 == 0; };
  for (std::uint64_t run = 0; run < 8; ++run) {
    Random random(seed + run);
    Scene scene = test::random_room(&random);
    for (BodyDef& body : scene.bodies) body.sensor = false;
    WorldSettings settings;
    settings.hit_speed = 0.01_r;
    World world(scene, settings);
    world.add_contact_generator([&](ContactContext& context) {
      for (DetectedContact& contact : context.detected()) {
        contact.ignored = is_ignored(contact.a, contact.b);
      }
    });
    for (int n = 0; n < 30; ++n) {
      world.step();
      for (const Contact& x : world.contacts()) ASSERT_FALSE(is_ignored(x.a, x.b));
      for (const ContactEvent& x : world.contact_events()) ASSERT_FALSE(is_ignored(x.a, x.b));
      for (const HitEvent& x : world.hit_events()) ASSERT_FALSE(is_ignored(x.a, x.b));
      for (const ContactForce& x : world.contact_forces()) ASSERT_FALSE(is_ignored(x.a, x.b));
    }
  }
}

}  // namespace
}  // namespace jfpx
