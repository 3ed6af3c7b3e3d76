/// Tests of World::replace() and World::definition().
#include <jfpx/error.hpp>

#include "tests/world/random_bodies.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <variant>

namespace jfpx {
namespace {

using test::operator""_r;
using test::ball;
using test::ground;
using test::world_with;

JFPX_SOFT_STEP_SUITE(Replace);

BodyDef cube(const Vec3& position, Real half_extent, Real mass = 1) {
  BodyDef def;
  def.shape = Box{{half_extent, half_extent, half_extent}};
  def.mass = mass;
  def.position = position;
  return def;
}

/// A world whose bodies are replaced before the first step moves as one whose bodies are defined
/// so, to the last bit.
TEST_P(Replace, ReplacedBodiesHaveTheBitsOfDefinedOnes) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int round = 0; round < 20; ++round) {
    Scene defined = test::empty_scene(), other = defined;
    for (int i = 0; i < 24; ++i) {
      other.bodies.push_back(test::random_body(&random, 2));
      BodyDef def = test::random_body(&random, 2);
      def.user_data = random.below(9);
      def.sensor = random.below(8) == 0;
      if (random.below(4) == 0) def.filter = {.category = 2, .mask = 0xfffffffdu};
      if (random.below(4) == 0) def.rolling_friction = 0.1_r;
      if (random.below(4) == 0 && def.mass > 0) def.inertia = diagonal({1, 1.5_r, 1.25_r});
      if (defined.solver == Solver::soft_step && random.below(4) == 0 && def.mass > 0) {
        def.motion_locks = test::random_locks(&random);
      }
      defined.bodies.push_back(def);
    }
    World expected(defined), world(other);
    for (std::size_t i = 0; i < defined.bodies.size(); ++i) {
      const BodyId id = world.bodies()[i];
      world.replace(id, defined.bodies[i]);
      ASSERT_TRUE(world.contains(id));
      ASSERT_EQ(world.definition(id), expected.definition(expected.bodies()[i]));
    }
    for (int n = 0; n < 40; ++n) {
      expected.step();
      world.step();
      ASSERT_EQ(world.state_hash(), expected.state_hash()) << round << ", step " << n;
    }
  }
}

/// All that a replacement changes is in snapshots.
TEST_P(Replace, WorldsContinueFromSnapshotsAfterIt) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int round = 0; round < 10; ++round) {
    Scene scene = test::empty_scene();
    for (int i = 0; i < 24; ++i) scene.bodies.push_back(test::random_body(&random, 2));
    scene.bodies.push_back(ground());
    World world(scene), restored(test::empty_scene());
    for (int n = 0; n < 40; ++n) {
      if (n % 4 == 0) {
        const BodyId id = world.bodies()[random.below(24)];
        BodyDef def = test::random_body(&random, 2);
        if (random.below(2) == 0) def.position = world.state(id).position;
        world.replace(id, def);
        restored.restore(world.snapshot());
      }
      world.step();
      restored.step();
      ASSERT_EQ(world.state_hash(), restored.state_hash()) << round << ", step " << n;
    }
  }
}

TEST_P(Replace, WakesTheBodyAboveASmallerOne) {
  World world = world_with({cube({0, 0.5_r, 0}, 0.5_r), cube({0, 1.5_r, 0}, 0.5_r),
                            cube({5, 0.5_r, 0}, 0.5_r), ground()});
  const BodyId lower = world.bodies()[0], upper = world.bodies()[1], far = world.bodies()[2];
  for (int n = 0; n < 200; ++n) world.step();
  ASSERT_FALSE(world.awake(upper));
  BodyDef def = world.definition(lower);
  def.shape = Box{{0.5_r, 0.25_r, 0.5_r}};
  def.position.y = 0.25_r;
  world.replace(lower, def);
  EXPECT_TRUE(world.contacts().empty());
  EXPECT_TRUE(world.awake(lower));
  EXPECT_TRUE(world.awake(upper));
  EXPECT_FALSE(world.awake(far));
  for (int n = 0; n < 200; ++n) world.step();
  EXPECT_NEAR(world.state(upper).position.y, 1, 0.02);
  EXPECT_EQ(std::get<Box>(world.shape(lower)).half_extents.y, 0.25_r);
  EXPECT_EQ(world.bodies()[0], lower);
}

TEST_P(Replace, AnImmovableBodyFallsWithAMassAndStaysWithoutOne) {
  World world = world_with({cube({0, 5, 0}, 0.5_r, 0), ground()});
  const BodyId id = world.bodies()[0];
  for (int n = 0; n < 10; ++n) world.step();
  EXPECT_EQ(world.state(id).position.y, 5);
  BodyDef def = world.definition(id);
  def.mass = 2;
  world.replace(id, def);
  EXPECT_EQ(world.mass(id), 2);
  for (int n = 0; n < 30; ++n) world.step();
  const BodyState falling = world.state(id);
  EXPECT_LT(falling.position.y, 4.5_r);
  def = world.definition(id);
  EXPECT_EQ(def.velocity, falling.velocity);
  def.mass = 0;
  def.velocity = {};
  world.replace(id, def);
  for (int n = 0; n < 30; ++n) world.step();
  EXPECT_EQ(world.state(id).position, falling.position);
  EXPECT_FALSE(world.awake(id));
}

/// A larger immovable body lifts what rests on it, so the search knows its new bounds.
TEST_P(Replace, ContactsAreThoseOfTheNewShape) {
  World world = world_with({cube({0, 0, 0}, 1, 0), ball({0, 1.5_r, 0}, 0.5_r)});
  const BodyId box = world.bodies()[0], top = world.bodies()[1];
  world.set_acceleration(top, {0, -10, 0});
  for (int n = 0; n < 60; ++n) world.step();
  EXPECT_NEAR(world.state(top).position.y, 1.5, 0.02);
  BodyDef def = world.definition(box);
  def.shape = Box{{0.5_r, 0.5_r, 0.5_r}};
  world.replace(box, def);
  for (int n = 0; n < 90; ++n) world.step();
  EXPECT_NEAR(world.state(top).position.y, 1, 0.02);
  def.shape = Sphere{0.75_r};
  def.mass = 0;
  world.replace(box, def);
  for (int n = 0; n < 120; ++n) world.step();
  EXPECT_NEAR(world.state(top).position.y, 1.25, 0.02);
}

TEST_P(Replace, ADamagedDefinitionLeavesTheWorldUnchanged) {
  World world = world_with({ball({0, 5, 0}), ground()});
  const BodyId id = world.bodies()[0];
  world.step();
  const Snapshot before = world.snapshot();
  BodyDef def = world.definition(id);
  def.mass = -1;
  EXPECT_THROW(world.replace(id, def), InvalidScene);
  def.mass = 1;
  def.shape = HalfSpace{{0, 1, 0}, 0};
  EXPECT_THROW(world.replace(id, def), InvalidScene);
  EXPECT_EQ(world.snapshot(), before);
  world.remove(id);
  EXPECT_THROW(world.replace(id, ball({})), InvalidArgument);
  EXPECT_THROW(static_cast<void>(world.definition(id)), InvalidArgument);
}

TEST(ReplaceWithJoints, JointsRemainAndNeedAMovableBody) {
  Scene scene;
  scene.bodies = {ball({0, 0, 0}, 0.2_r), ball({1, 0, 0}, 0.2_r)};
  for (BodyDef& def : scene.bodies) def.acceleration = {0, -10, 0};
  World world(scene);
  const BodyId a = world.bodies()[0], b = world.bodies()[1];
  const JointId joint =
      world.add_joint(DistanceJoint{.a = a, .b = b, .min_length = 1, .max_length = 1});
  for (int n = 0; n < 10; ++n) world.step();
  BodyDef def = world.definition(a);
  def.mass = 0;
  world.replace(a, def);
  EXPECT_TRUE(world.contains_joint(joint));
  const Vec3 pivot = world.state(a).position;
  World restored((Scene()));
  restored.restore(world.snapshot());
  for (int n = 0; n < 60; ++n) {
    world.step();
    restored.step();
    ASSERT_EQ(restored.state_hash(), world.state_hash());
  }
  EXPECT_EQ(world.state(a).position, pivot);
  EXPECT_NEAR(length(world.state(b).position - pivot), 1, 0.01);
  def = world.definition(b);
  def.mass = 0;
  try {
    world.replace(b, def);
    FAIL() << "no exception";
  } catch (const InvalidArgument& error) {
    EXPECT_STREQ(error.what(),
                 "mass is 0; it must be > 0, because joint 0 has no other movable body");
  }
  EXPECT_GT(world.mass(b), 0);
}

}  // namespace
}  // namespace jfpx
