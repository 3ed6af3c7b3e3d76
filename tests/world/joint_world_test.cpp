/// Joints as a part of a World: ids, contacts, sleep, removal, snapshots, and equal bits.
#include <jfpx/recorded_world.hpp>
#include <jfpx/recording.hpp>

#include "tests/support/temporary_folder.hpp"
#include "tests/world/joint_scene.hpp"
#include "tests/world/support.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

namespace jfpx {
namespace {

using test::ball;
using test::body;
using test::kNan;
using test::operator""_r;
using ::testing::HasSubstr;

/// Two balls without gravity, which touch.
Scene two_balls() {
  Scene scene;
  scene.bodies = {ball({0, 0, 0}), ball({1.9_r, 0, 0})};
  return scene;
}
DistanceJoint rod_of(BodyId a, std::optional<BodyId> b, Real length) {
  return {.a = a, .b = b, .min_length = length, .max_length = length};
}

void step(World* world, int count) {
  for (int n = 0; n < count; ++n) world->step();
}

WorldSettings with_threads(unsigned threads, SimdLevel simd = SimdLevel::automatic) {
  return {.collider = {.backend = Backend::cpu, .simd = simd}, .threads = threads};
}

TEST(JointWorld, HasTheSameBitsForAllThreadsAndVectorWidths) {
  const Scene scene = test::joint_scene();
  World one(scene, with_threads(1));
  World three(scene, with_threads(3, SimdLevel::scalar));
  World eight(scene, with_threads(8, SimdLevel::sse2));
  for (int n = 0; n < 150; ++n) {
    ASSERT_GT(one.step().contacts, 0u);
    three.step();
    eight.step();
    ASSERT_EQ(one.snapshot(), three.snapshot()) << n;
    ASSERT_EQ(one.snapshot(), eight.snapshot()) << n;
  }
}

TEST(JointWorld, ASnapshotContinuesWithTheSameBits) {
  World world(test::joint_scene());
  step(&world, 40);
  const Snapshot snapshot = world.snapshot();
  World other(two_balls());
  other.restore(snapshot);
  EXPECT_TRUE(std::ranges::equal(world.joints(), other.joints()));
  for (const JointId id : world.joints()) {
    ASSERT_EQ(world.joint(id), other.joint(id));
    ASSERT_EQ(world.joint_state(id), other.joint_state(id));
  }
  for (int n = 0; n < 40; ++n) {
    world.step();
    other.step();
    ASSERT_EQ(world.snapshot(), other.snapshot()) << n;
  }
}

TEST(JointWorld, AScenesJsonKeepsItsJoints) {
  Scene scene = test::joint_scene();
  EXPECT_EQ(from_json(to_json(scene)), scene);
  EXPECT_THAT(to_json(scene), HasSubstr(R"("joints": [)"));
  scene.joints.clear();
  EXPECT_THAT(to_json(scene), testing::Not(HasSubstr("joints\":")));
  EXPECT_EQ(
      std::get<DistanceJoint>(from_json(R"({"jfpx_scene": 2, "bodies": [{"shape": {"type": "sphere",
                    "radius": 1}}], "joints": [{"type": "distance", "a": 0}]})")
                                  .joints[0]),
      DistanceJoint{.a = body(0)});
}

TEST(JointWorld, JoinedBodiesHaveNoContactsUnlessTheyCollide) {
  for (const bool collides : {false, true}) {
    Scene scene = two_balls();
    World world(scene);
    EXPECT_EQ(world.step().contacts, 1u);
    // They touch already.
    DistanceJoint joint{.a = body(0), .b = body(1), .collide_connected = collides};
    const JointId first = world.add_joint(joint), second = world.add_joint(joint);
    EXPECT_EQ(world.step().contacts, collides ? 1u : 0u);
    if (!collides) {
      ASSERT_EQ(world.contact_events().size(), 1u);
      EXPECT_EQ(world.contact_events()[0].phase, ContactPhase::end);
    }
    EXPECT_FALSE(world.pair_ignored(body(0), body(1)));
    world.remove_joint(first);
    EXPECT_EQ(world.step().contacts, collides ? 1u : 0u) << "another joint remains";
    joint.collide_connected = !collides;
    world.set_joint(second, joint);
    EXPECT_EQ(world.step().contacts, collides ? 0u : 1u);
    world.remove_joint(second);
    world.step();
    EXPECT_EQ(world.step().contacts, 1u);
  }
}

TEST(JointWorld, IdsAreNeverReused) {
  World world(two_balls());
  const JointId first = world.add_joint(rod_of(body(0), body(1), 2));
  EXPECT_TRUE(world.contains_joint(first));
  world.remove_joint(first);
  EXPECT_FALSE(world.contains_joint(first));
  const JointId second = world.add_joint(rod_of(body(0), std::nullopt, 1));
  EXPECT_EQ(second.index, first.index);
  EXPECT_FALSE(second == first);
  EXPECT_THROW(world.joint(first), InvalidArgument);
  EXPECT_THROW(world.joint_state(first), InvalidArgument);
  EXPECT_THROW(world.remove_joint(first), InvalidArgument);
  EXPECT_THROW(world.set_joint(first, rod_of(body(0), std::nullopt, 1)), InvalidArgument);
  EXPECT_EQ(std::get<DistanceJoint>(world.joint(second)).max_length, 1);
}

/// The entries of a joint at both of its bodies may follow each other, and are removed together.
TEST(JointWorld, TheBodiesOfAChainAreRemovedOneByOne) {
  Scene scene;
  for (std::uint32_t i = 0; i < 20; ++i) {
    scene.bodies.push_back(ball({3 * static_cast<Real>(i), 0, 0}));
    if (i > 0) scene.joints.push_back(rod_of(body(i - 1), body(i), 3));
  }
  World world(scene);
  for (std::uint32_t i = 0; i + 1 < 20; ++i) {
    world.remove(body(i));
    ASSERT_EQ(world.joints().size(), 18u - i);
    world.step();
  }
}

TEST(JointWorld, ABodyIsRemovedWithItsJoints) {
  Scene scene;
  scene.bodies = {ball({0, 5, 0}, 0.2_r)};
  for (int i = 1; i <= 200; ++i) {
    scene.bodies.push_back(ball({static_cast<Real>(i), 0, 0}, 0.2_r));
    scene.bodies.back().can_sleep = true;
    scene.joints.push_back(DistanceJoint{.a = body(0), .b = body(static_cast<std::uint32_t>(i))});
  }
  scene.joints.push_back(rod_of(body(1), body(2), 1));
  scene.bodies[0].can_sleep = true;
  World world(scene);
  step(&world, 60);
  ASSERT_FALSE(world.awake(body(7)));
  world.remove(body(0));
  ASSERT_EQ(world.joints().size(), 1u);
  EXPECT_EQ(std::get<DistanceJoint>(world.joint(world.joints()[0])).b, body(2));
  EXPECT_TRUE(world.awake(body(7))) << "it was joined with the removed body";
  World other(two_balls());
  other.restore(world.snapshot());
  step(&world, 5);
  step(&other, 5);
  EXPECT_EQ(world.state_hash(), other.state_hash());
  // The slot is used by a body that is not joined.
  const BodyId added = world.add(ball({0, 5, 0}, 0.2_r));
  EXPECT_EQ(added.index, 0u);
  step(&world, 5);
  EXPECT_EQ(world.state(added).position, (Vec3{0, 5, 0}));
}

TEST(JointWorld, JoinedBodiesSleepAndWakeTogether) {
  Scene scene;
  for (int i = 0; i < 3; ++i) {
    scene.bodies.push_back(ball({4 * static_cast<Real>(i), 0, 0}, 0.2_r));
    scene.bodies.back().can_sleep = true;
  }
  scene.joints = {DistanceJoint{.a = body(0), .b = body(1), .max_length = 10}};
  World world(scene);
  BodyState moving = world.state(body(0));
  moving.velocity = {0, 0.5_r, 0};
  const auto keep_moving = [&](int count) {
    for (int n = 0; n < count; ++n) {
      world.set_state(body(0), moving);
      world.step();
    }
  };
  keep_moving(60);
  EXPECT_TRUE(world.awake(body(1))) << "its island is not at rest";
  EXPECT_FALSE(world.awake(body(2)));
  moving.velocity = {};
  world.set_state(body(0), moving);
  step(&world, 60);
  EXPECT_FALSE(world.awake(body(0)));
  EXPECT_FALSE(world.awake(body(1)));
  world.apply_force(body(0), {0, 1, 0});
  step(&world, 1);
  EXPECT_TRUE(world.awake(body(1)));
  EXPECT_FALSE(world.awake(body(2)));
}

/// A body of a shape without damping.
BodyDef solid(const Shape& shape, const Vec3& position, Real mass) {
  BodyDef def;
  def.shape = shape;
  def.position = position;
  def.mass = mass;
  def.linear_damping = def.angular_damping = 1;
  return def;
}

// The impulse of a contact with the foot moves the body above, too. At the frequency of other
// contacts, the foot vibrated for ever.
TEST(JointWorld, AHeavyBodyRestsOnALightFoot) {
  for (const Shape& foot : {Shape(Box{{0.5_r, 0.5_r, 0.5_r}}), Shape(Sphere{0.5_r})}) {
    for (const Real mass : {50.0_r, 200.0_r, 1000.0_r}) {
      Scene scene;
      scene.bodies = {solid(Box{{9, 1, 9}}, {0, -1, 0}, 0), solid(foot, {0, 0.5_r, 0}, 20),
                      solid(Box{{1, 1, 1}}, {0, 2, 0}, mass)};
      World world(scene);
      const BodyId low = world.bodies()[1], high = world.bodies()[2];
      FixedJoint joint{.a = high, .b = low};
      place_joint(&joint, world.state(high), world.state(low), {0, 1, 0}, Vec3{0, 1, 0});
      world.add_joint(joint);
      step(&world, 1200);
      EXPECT_FALSE(world.awake(high)) << mass << " kg on shape " << foot.index();
      EXPECT_LT(length(world.state(high).position - Vec3{0, 2, 0}), 0.005_r) << mass;
    }
  }
}

TEST(JointWorld, AHeavyTableRestsOnLightLegs) {
  Scene scene;
  scene.bodies = {solid(Box{{9, 1, 9}}, {0, -1, 0}, 0)};
  World world(scene);
  const Vec3 start{0, 1.1_r, 0};
  const BodyId slab = world.add(solid(Box{{1, 0.1_r, 1}}, start, 1000));
  for (const Real x : {-0.8_r, 0.8_r}) {
    for (const Real z : {-0.8_r, 0.8_r}) {
      const BodyId leg = world.add(solid(Box{{0.2_r, 0.5_r, 0.2_r}}, {x, 0.5_r, z}, 20));
      FixedJoint joint{.a = leg, .b = slab};
      place_joint(&joint, world.state(leg), world.state(slab), {x, 1, z}, Vec3{0, 1, 0});
      world.add_joint(joint);
    }
  }
  step(&world, 1200);
  EXPECT_FALSE(world.awake(slab));
  EXPECT_LT(length(world.state(slab).position - start), 0.005_r);
}

TEST(JointWorld, AParkedCarFallsAsleep) {
  for (const Shape& shape : {Shape(Cylinder{0.4_r, 0.15_r}), Shape(Sphere{0.4_r})}) {
    for (const Real torque : {Real(0), 3000.0_r}) {
      Scene scene;
      scene.bodies = {solid(HalfSpace{}, {}, 0)};
      World world(scene);
      const BodyId chassis = world.add(solid(Box{{0.9_r, 0.3_r, 2}}, {0, 0.9_r, 0}, 1000));
      for (const Real x : {-0.9_r, 0.9_r}) {
        for (const Real z : {-1.4_r, 1.4_r}) {
          const Vec3 hub{x, 0.4_r, z};
          BodyDef def = solid(shape, hub, 20);
          def.orientation = from_axis_angle({0, 0, 1}, kPi / 2);
          def.friction = 1;
          const BodyId wheel = world.add(def);
          WheelJoint joint{.a = wheel, .b = chassis};
          joint.hertz = 3;
          joint.damping_ratio = 0.7_r;
          joint.max_motor_torque = torque;
          place_joint(&joint, world.state(wheel), world.state(chassis), hub,
                      axes_along({1, 0, 0}, {0, 1, 0}));
          world.add_joint(joint);
        }
      }
      step(&world, 1200);
      EXPECT_FALSE(world.awake(chassis)) << "shape " << shape.index() << ", " << torque << " N m";
    }
  }
}

// The ball of a pendulum has a ManifoldRow with the wall.
TEST(JointWorld, AnElasticPendulumReboundsFromAWall) {
  Scene scene;
  scene.bodies = {solid(Sphere{0.5_r}, {-2, 0, 0}, 1), solid(Box{{1, 3, 3}}, {1.5_r, -2, 0}, 0)};
  for (BodyDef& def : scene.bodies) def.restitution = 1, def.friction = 0;
  World world(scene);
  const BodyId ball = world.bodies()[0];
  DistanceJoint rod = rod_of(ball, std::nullopt, 2);
  world.add_joint(rod);
  Real before = 0, after = 0;  // largest speeds
  for (int n = 0; n < 120; ++n) {
    world.step();
    const Vec3 velocity = world.state(ball).velocity;
    Real& largest = velocity.x > 0 && after == 0 ? before : after;
    largest = std::max(largest, length(velocity));
  }
  EXPECT_NEAR(before, std::sqrt(2 * 9.81_r * 2), 0.1_r);
  EXPECT_NEAR(after, before, 0.1_r);
}

TEST(JointWorld, AddingChangingAndRemovingAJointWakesItsBodies) {
  Scene scene;
  for (int i = 0; i < 2; ++i) {
    scene.bodies.push_back(ball({4 * static_cast<Real>(i), 0, 0}, 0.2_r));
    scene.bodies.back().can_sleep = true;
  }
  World world(scene);
  const auto sleep = [&] {
    step(&world, 120);
    ASSERT_FALSE(world.awake(body(0)) || world.awake(body(1)));
  };
  const auto expect_awake = [&](const char* after) {
    EXPECT_TRUE(world.awake(body(0)) && world.awake(body(1))) << after;
  };
  sleep();
  DistanceJoint joint = rod_of(body(0), body(1), 4);
  const JointId id = world.add_joint(joint);
  expect_awake("add_joint");
  sleep();
  joint.min_length = joint.max_length = 3;
  world.set_joint(id, joint);
  expect_awake("set_joint");
  step(&world, 60);
  EXPECT_NEAR(static_cast<double>(world.joint_state(id).length), 3, 1e-3);
  sleep();
  world.remove_joint(id);
  expect_awake("remove_joint");
}

TEST(JointWorld, AFailedStepChangesNoJoint) {
  Scene scene = test::joint_scene();
  scene.bodies.push_back(ball({100, 100, 100}));
  World world(scene), twin(scene);
  step(&world, 20);
  step(&twin, 20);
  const BodyId runaway = world.bodies().back();
  BodyState state = world.state(runaway);
  state.velocity = {1e30_r, 0, 0};
  world.set_state(runaway, state);
  ASSERT_TRUE(world.step().non_finite);
  for (World* w : {&world, &twin}) w->set_state(runaway, twin.state(runaway));
  for (int n = 0; n < 10; ++n) {
    world.step();
    twin.step();
    ASSERT_EQ(world.snapshot(), twin.snapshot()) << n;
  }
}

TEST(JointWorld, RecordedJointsAreRepeated) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("joints.rec");
  Scene scene = two_balls();
  scene.bodies.push_back(ball({0, 5, 0}));
  std::uint64_t hash = 0;
  {
    RecordedWorld recorded(path, scene);
    recorded.step();
    DistanceJoint joint = rod_of(body(0), body(2), 4);
    joint.user_data = 3;
    const JointId id = recorded.add_joint(joint);
    const JointId spring = recorded.add_joint(
        DistanceJoint{.a = body(1), .anchor_b = {1, 2, 3}, .rest_length = 1, .hertz = 2});
    for (int n = 0; n < 5; ++n) recorded.step();
    joint.min_length = 2;
    recorded.set_joint(id, joint);
    recorded.step();
    recorded.remove_joint(spring);
    for (int n = 0; n < 5; ++n) recorded.step();
    hash = recorded.world().state_hash();
    recorded.finish();
  }
  RecordingReader reader(path);
  World world(reader.header().scene);
  for (std::uint64_t n = 1; n <= reader.steps(); ++n) {
    repeat_calls(reader, n, world);
    world.step();
  }
  EXPECT_EQ(world.state_hash(), hash);
  ASSERT_EQ(world.joints().size(), 1u);
  EXPECT_EQ(std::get<DistanceJoint>(world.joint(world.joints()[0])).user_data, 3u);
}

/// The message of the exception of an invalid joint of three bodies, of which the last is
/// immovable.
std::string complaint(const Joint& joint) {
  Scene scene = two_balls();
  scene.bodies.push_back(ball({9, 9, 9}, 1, 0));
  scene.bodies.push_back(ball({9, 9, 9}, 1, 0));
  World world(scene);
  try {
    world.add_joint(joint);
  } catch (const InvalidArgument& error) {
    EXPECT_TRUE(world.joints().empty());
    return error.what();
  }
  return "no exception";
}

TEST(JointWorld, ErrorsNameFieldValueAndRange) {
  const DistanceJoint good = rod_of(body(0), body(1), 2);
  const auto with = [&](auto DistanceJoint::*field, const auto& value) {
    DistanceJoint joint = good;
    joint.*field = value;
    return complaint(joint);
  };
  EXPECT_THAT(with(&DistanceJoint::a, body(9)), HasSubstr("body id (index 9, generation 0)"));
  EXPECT_THAT(with(&DistanceJoint::b, std::optional(BodyId{1, 3})),
              HasSubstr("body id (index 1, generation 3)"));
  EXPECT_THAT(with(&DistanceJoint::b, std::optional(body(0))),
              HasSubstr("b is body 0; it must be another body than a"));
  EXPECT_THAT(with(&DistanceJoint::min_length, Real(3)),
              HasSubstr("min_length is 3; it must be at most max_length, which is 2"));
  EXPECT_THAT(with(&DistanceJoint::min_length, Real(-1)),
              HasSubstr("min_length is -1; it must be in [0, 1e9]"));
  EXPECT_THAT(with(&DistanceJoint::max_length, kNan), HasSubstr("max_length is nan"));
  EXPECT_THAT(with(&DistanceJoint::rest_length, Real(-1)), HasSubstr("rest_length is -1"));
  EXPECT_THAT(with(&DistanceJoint::hertz, Real(-1)), HasSubstr("hertz is -1"));
  EXPECT_THAT(with(&DistanceJoint::damping_ratio, kNan), HasSubstr("damping_ratio is nan"));
  EXPECT_THAT(with(&DistanceJoint::anchor_a, Vec3{kNan, 0, 0}), HasSubstr("anchor_a is (nan"));
  EXPECT_THAT(with(&DistanceJoint::anchor_b, Vec3{0, 2e9_r, 0}), HasSubstr("anchor_b is (0, 2e"));
  EXPECT_THAT(complaint(rod_of(body(2), body(3), 1)), HasSubstr("both bodies have mass 0"));
  EXPECT_THAT(complaint(rod_of(body(2), std::nullopt, 1)), HasSubstr("mass 0"));
  World world(two_balls());
  const JointId id = world.add_joint(good);
  EXPECT_THROW(world.set_joint(id, rod_of(body(1), body(0), 2)), InvalidArgument);
}

std::string complaint(const Scene& scene) {
  try {
    validate(scene);
  } catch (const InvalidScene& error) {
    return error.what();
  }
  return "no exception";
}

TEST(JointWorld, ErrorsOfScenesNameTheJoint) {
  Scene scene = two_balls();
  scene.joints = {rod_of(body(0), body(1), 2), rod_of(body(0), body(5), 2)};
  EXPECT_THAT(complaint(scene), HasSubstr("joints[1]: b is 5; it must be an index of the scene's "
                                          "2 bodies"));
  scene.joints[1] = DistanceJoint{.a = body(1), .min_length = 2, .max_length = 1};
  EXPECT_THAT(complaint(scene), HasSubstr("joints[1]: min_length is 2"));
  scene.joints.pop_back();
  scene.solver = Solver::worst_first;
  EXPECT_THAT(complaint(scene), HasSubstr("it must be soft_step for a scene with joints"));
  scene.joints.clear();
  World world(scene);
  EXPECT_THROW(world.add_joint(rod_of(body(0), body(1), 2)), InvalidArgument);
}

}  // namespace
}  // namespace jfpx
