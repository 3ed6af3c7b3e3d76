/// Tests of the properties of bodies that can be changed between steps: mass, inertia, materials,
/// acceleration, damping, user data.
#include <jfpx/error.hpp>

#include "tests/world/random_bodies.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace jfpx {
namespace {

using test::operator""_r;
using test::kInfinity;
using test::kNan;
using test::world_with;

JFPX_SOFT_STEP_SUITE(Property);

BodyDef resting_box(const Vec3& position) {
  BodyDef def;
  def.shape = Box{{0.5_r, 0.5_r, 0.5_r}};
  def.position = position;
  return def;
}

/// The message of the error; empty if there is none.
std::string complaint(const std::function<void()>& call) {
  try {
    call();
  } catch (const InvalidArgument& error) {
    return error.what();
  }
  return {};
}

TEST_P(Property, IsThatOfTheDefinition) {
  BodyDef def = test::ball({0, 0, 0}, 1, 5);
  def.friction = 0.75_r;
  def.restitution = 0.25_r;
  def.acceleration = {1, 2, 3};
  def.linear_damping = 0.5_r;
  def.angular_damping = 0.125_r;
  def.user_data = 0xfedcba9876543210u;
  def.inertia = Mat3{{{3, 0.5_r, 0}, {0.5_r, 3, 0}, {0, 0, 4}}};
  World world = world_with({def, test::ball({9, 0, 0}, 1, 5), test::ground()});
  const BodyId id = world.bodies()[0], ball = world.bodies()[1], ground = world.bodies()[2];
  EXPECT_EQ(world.friction(id), 0.75_r);
  EXPECT_EQ(world.restitution(id), 0.25_r);
  EXPECT_EQ(world.acceleration(id), (Vec3{1, 2, 3}));
  EXPECT_EQ(world.linear_damping(id), 0.5_r);
  EXPECT_EQ(world.angular_damping(id), 0.125_r);
  EXPECT_EQ(world.user_data(id), 0xfedcba9876543210u);
  EXPECT_EQ(world.inertia(id), *def.inertia);
  EXPECT_EQ(world.user_data(ball), 0u);
  EXPECT_NEAR(world.inertia(ball)(1, 1), 2, 1e-6);  // 0.4 m r^2
  EXPECT_EQ(world.inertia(ground), diagonal({0, 0, 0}));
  world.set_user_data(ground, 7);
  EXPECT_EQ(world.user_data(ground), 7u);
}

/// A world whose bodies get their properties by setters moves as one whose bodies are defined with
/// them, to the last bit.
TEST_P(Property, ThatIsSetGivesTheBitsOfABodyDefinedWithIt) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int round = 0; round < 20; ++round) {
    Scene defined = test::empty_scene(), plain = defined;
    for (int i = 0; i < 20; ++i) {
      BodyDef def = test::random_body(&random, 2);
      def.angular_velocity = random.uniform_in_box({-2, -2, -2}, {2, 2, 2});
      plain.bodies.push_back(def);
      if (def.mass > 0) def.mass = random.uniform(0.5_r, 9);
      if (i % 3 == 0 && def.mass > 0) def.inertia = diagonal({1, 1.5_r, 1.25_r}) * def.mass;
      def.friction = random.uniform(0, 1);
      def.restitution = random.uniform(0, 1);
      def.acceleration = random.uniform_in_box({-9, -9, -9}, {9, 9, 9});
      def.linear_damping = random.uniform(0.1_r, 1);
      def.angular_damping = random.uniform(0.1_r, 1);
      defined.bodies.push_back(def);
    }
    World expected(defined), world(plain);
    for (std::size_t i = 0; i < 20; ++i) {
      const BodyId id = world.bodies()[i];
      const BodyDef& def = defined.bodies[i];
      if (i % 2 == 0) world.set_mass(id, def.mass);
      if (def.inertia) world.set_inertia(id, *def.inertia);
      if (i % 2 != 0) world.set_mass(id, def.mass);
      world.set_friction(id, def.friction);
      world.set_restitution(id, def.restitution);
      world.set_acceleration(id, def.acceleration);
      world.set_damping(id, def.linear_damping, def.angular_damping);
      ASSERT_EQ(world.mass(id), def.mass);
      ASSERT_EQ(world.inertia(id), expected.inertia(id));
      ASSERT_EQ(world.inverse_inertia(id), expected.inverse_inertia(id));
    }
    for (int n = 0; n < 30; ++n) {
      expected.step();
      world.step();
      ASSERT_EQ(world.state_hash(), expected.state_hash()) << round << ", step " << n;
    }
  }
}

TEST_P(Property, MassAndInertiaDivideForceAndTorque) {
  World world = world_with({test::ball({0, 0, 0}, 1, 2)});
  const BodyId id = world.bodies()[0];
  const Real dt = world.settings().dt;
  world.set_mass(id, 8);
  world.apply_force(id, {4, 0, 0});
  world.apply_torque(id, {0, 0, 6.4_r});
  world.step();
  EXPECT_NEAR(world.state(id).velocity.x, 0.5 * static_cast<double>(dt), 1e-8);
  // 0.4 m r^2 = 3.2
  EXPECT_NEAR(world.state(id).angular_velocity.z, 2 * static_cast<double>(dt), 1e-8);

  world.set_state(id, {});
  world.set_inertia(id, diagonal({1, 1, 2}));
  world.set_mass(id, 4);  // an inertia that was set remains
  EXPECT_EQ(world.inertia(id), diagonal({1, 1, 2}));
  world.apply_force(id, {4, 0, 0});
  world.apply_torque(id, {0, 0, 6});
  world.step();
  EXPECT_NEAR(world.state(id).velocity.x, dt, 1e-8);
  EXPECT_NEAR(world.state(id).angular_velocity.z, 3 * static_cast<double>(dt), 1e-8);

  world.set_inertia(id, std::nullopt);  // that of the solid ball again
  EXPECT_NEAR(world.inertia(id)(2, 2), 1.6, 1e-6);
  world.set_mass(id, 10);
  EXPECT_NEAR(world.inertia(id)(2, 2), 4, 1e-6);
}

/// The vector turned by the quaternion, or back if sign is -1, in double.
std::array<double, 3> turned(const Quat& q, const std::array<double, 3>& v, double sign) {
  const double w = q.w, x = sign * static_cast<double>(q.x), y = sign * static_cast<double>(q.y),
               z = sign * static_cast<double>(q.z);
  const double tx = 2 * (y * v[2] - z * v[1]), ty = 2 * (z * v[0] - x * v[2]),
               tz = 2 * (x * v[1] - y * v[0]);
  return {v[0] + w * tx + y * tz - z * ty, v[1] + w * ty + z * tx - x * tz,
          v[2] + w * tz + x * ty - y * tx};
}

/// The inertia in body axes times a vector in world axes, in double.
std::array<double, 3> angular_momentum(const World& world, BodyId id, const Vec3& velocity) {
  const Quat q = world.state(id).orientation;
  const Mat3 inertia = world.inertia(id);
  const std::array<double, 3> local = turned(q, {velocity.x, velocity.y, velocity.z}, -1);
  std::array<double, 3> momentum{};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      momentum[static_cast<std::size_t>(row)] +=
          static_cast<double>(inertia(row, column)) * local[static_cast<std::size_t>(column)];
    }
  }
  return turned(q, momentum, 1);
}

TEST_P(Property, ImpulsesChangeMomentaAsInDouble) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int round = 0; round < 200; ++round) {
    const BodyDef def = test::random_body(&random, 3);
    World world = world_with({def});
    const BodyId id = world.bodies()[0];
    const BodyState before = world.state(id);
    const Vec3 impulse = random.uniform_in_box({-9, -9, -9}, {9, 9, 9});
    const Vec3 point = random.uniform_in_box({-5, -5, -5}, {5, 5, 5});
    const Vec3 spin = random.uniform_in_box({-9, -9, -9}, {9, 9, 9});
    world.apply_impulse(id, impulse);
    world.apply_impulse_at_point(id, impulse, point);
    world.apply_angular_impulse(id, spin);
    const BodyState after = world.state(id);
    ASSERT_EQ(after.position, before.position);
    ASSERT_EQ(after.orientation, before.orientation);
    const double mass = world.mass(id);
    if (!(mass > 0)) {
      ASSERT_EQ(after.velocity, before.velocity);
      ASSERT_EQ(after.angular_velocity, before.angular_velocity);
      continue;
    }
    const std::array<double, 3> j{impulse.x, impulse.y, impulse.z}, s{spin.x, spin.y, spin.z},
        v0{before.velocity.x, before.velocity.y, before.velocity.z},
        v1{after.velocity.x, after.velocity.y, after.velocity.z},
        r{static_cast<double>(point.x) - static_cast<double>(before.position.x),
          static_cast<double>(point.y) - static_cast<double>(before.position.y),
          static_cast<double>(point.z) - static_cast<double>(before.position.z)};
    const std::array<double, 3> l0 = angular_momentum(world, id, before.angular_velocity),
                                l1 = angular_momentum(world, id, after.angular_velocity);
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t a = (i + 1) % 3, b = (i + 2) % 3;
      ASSERT_NEAR(mass * (v1[i] - v0[i]), 2 * j[i], 1e-4) << round;
      ASSERT_NEAR(l1[i] - l0[i], s[i] + r[a] * j[b] - r[b] * j[a], 5e-3) << round;
    }
  }
}

TEST_P(Property, ImpulsesWakeBodiesAndRefuseInfiniteVelocities) {
  BodyDef wall = resting_box({9, 0, 0}), moved = resting_box({-9, 0, 0});
  wall.mass = moved.mass = 0;
  moved.kinematic = true;
  World world = world_with({resting_box({}), wall, moved});
  const BodyId box = world.bodies()[0];
  for (const BodyId id : {world.bodies()[1], world.bodies()[2]}) {
    world.apply_impulse(id, {1, 2, 3});
    world.apply_angular_impulse(id, {1, 2, 3});
    EXPECT_EQ(world.state(id).velocity, Vec3{});
    EXPECT_EQ(world.state(id).angular_velocity, Vec3{});
    EXPECT_FALSE(world.awake(id));
  }
  world.set_acceleration(box, {});
  for (int n = 0; n < 600 && world.awake(box); ++n) world.step();
  ASSERT_FALSE(world.awake(box));
  world.apply_impulse(box, {1, 0, 0});
  EXPECT_TRUE(world.awake(box));

  const std::uint64_t hash = world.state_hash();
  const Real highest = std::numeric_limits<Real>::max();
  EXPECT_NE(complaint([&] { world.apply_impulse(box, {kNan, 0, 0}); }), "");
  EXPECT_NE(complaint([&] { world.apply_impulse_at_point(box, {}, {0, kInfinity, 0}); }), "");
  EXPECT_NE(complaint([&] { world.apply_angular_impulse(box, {0, kNan, 0}); }), "");
  EXPECT_NE(complaint([&] { world.apply_impulse({99, 0}, {}); }), "");
  world.set_mass(box, 0.25_r);
  const std::string message = complaint([&] { world.apply_impulse(box, {highest, 0, 0}); });
  EXPECT_NE(message.find("state after the impulse: velocity"), std::string::npos) << message;
  EXPECT_NE(complaint([&] { world.apply_angular_impulse(box, {0, highest, 0}); }), "");
  EXPECT_EQ(world.state_hash(), hash);
}

TEST_P(Property, MassesDecideACollision) {
  BodyDef left = test::ball({-1.01_r, 0, 0}), right = test::ball({1.01_r, 0, 0});
  left.velocity = {3, 0, 0};
  left.restitution = right.restitution = 1;
  World world = world_with({left, right});
  world.set_mass(world.bodies()[0], 2);
  world.set_mass(world.bodies()[1], 4);
  for (int n = 0; n < 10; ++n) world.step();
  // v1 = (m1 - m2) / (m1 + m2) v, v2 = 2 m1 / (m1 + m2) v
  EXPECT_NEAR(world.states()[0].velocity.x, -1, 0.02);
  EXPECT_NEAR(world.states()[1].velocity.x, 2, 0.02);
}

TEST_P(Property, DampingKeepsAFractionPerSecond) {
  BodyDef def = test::ball({0, 0, 0});
  def.velocity = {8, 0, 0};
  def.angular_velocity = {0, 4, 0};
  Scene scene = test::empty_scene();
  scene.dt = Real(1) / 64;
  scene.bodies = {def};
  World world(scene);
  const BodyId id = world.bodies()[0];
  world.set_damping(id, 0.5_r, 0.25_r);
  for (int n = 0; n < 64; ++n) world.step();
  EXPECT_NEAR(world.state(id).velocity.x, 4, 1e-4);
  EXPECT_NEAR(world.state(id).angular_velocity.y, 1, 1e-4);
  world.set_damping(id, 1, 1);
  const BodyState before = world.state(id);
  world.step();
  EXPECT_EQ(world.state(id).velocity, before.velocity);
}

TEST_P(Property, RestitutionDecidesTheBounce) {
  BodyDef ball = test::ball({0, 1.01_r, 0});
  ball.velocity = {0, -4, 0};
  World world = world_with({ball, test::ground()});
  for (const BodyId id : world.bodies()) world.set_restitution(id, 0.5_r);
  for (int n = 0; n < 10; ++n) world.step();
  EXPECT_NEAR(world.states()[0].velocity.y, 2, 1e-4);
}

TEST_P(Property, FrictionOfTheGroundLetsASleepingBoxSlide) {
  BodyDef box = resting_box({0, 0, 0});
  const Real slope = 0.3_r;  // [rad], below the angle of friction 0.46
  const Vec3 normal{std::sin(slope), std::cos(slope), 0};
  box.position = normal * 0.499_r;
  box.orientation = normalized(Quat{std::cos(slope / 2), 0, 0, -std::sin(slope / 2)});
  World world = world_with({box, test::half_space(normal, 0)});
  const BodyId id = world.bodies()[0], ground = world.bodies()[1];
  for (int n = 0; n < 400; ++n) world.step();
  ASSERT_FALSE(world.awake(id));
  const Vec3 before = world.state(id).position;
  world.set_friction(ground, world.friction(ground));
  EXPECT_FALSE(world.awake(id)) << "the same value changes nothing";
  world.set_friction(ground, 0);
  EXPECT_TRUE(world.awake(id));
  for (int n = 0; n < 60; ++n) world.step();
  // Without friction, it slides g sin(slope) t^2 / 2 = 1.45 m in a second.
  EXPECT_NEAR(length(world.state(id).position - before), 1.45, 0.08);
}

TEST_P(Property, AccelerationWakesTheBody) {
  BodyDef def = test::ball({0, 0, 0});
  def.can_sleep = true;
  World world = world_with({def});
  const BodyId id = world.bodies()[0];
  for (int n = 0; n < 120; ++n) world.step();
  ASSERT_FALSE(world.awake(id));
  world.set_restitution(id, 1);
  world.set_damping(id, 0.5_r, 0.5_r);
  world.set_user_data(id, 1);
  world.set_mass(id, world.mass(id));
  world.set_acceleration(id, {});
  EXPECT_FALSE(world.awake(id));
  world.set_acceleration(id, {6, 0, 0});
  EXPECT_TRUE(world.awake(id));
  world.step();
  // Each of k substeps accelerates by 0.1 / k and then damps: a geometric sum.
  const double k = test::substeps(world.settings()), q = std::pow(0.5, 1 / (60 * k));
  EXPECT_NEAR(world.state(id).velocity.x, 0.1 / k * q * (1 - std::pow(q, k)) / (1 - q), 1e-6);
  for (const auto& change :
       std::vector<std::function<void()>>{[&] { world.set_mass(id, 3); },
                                          [&] {
                                            world.set_inertia(id, diagonal({1, 1, 1}));
                                          }}) {
    world.set_acceleration(id, {});
    world.set_state(id, {});
    for (int n = 0; n < 120; ++n) world.step();
    ASSERT_FALSE(world.awake(id));
    change();
    EXPECT_TRUE(world.awake(id));
  }
}

TEST_P(Property, OfAnImmovableBodyStaysThatOfAnImmovableBody) {
  BodyDef lift = test::ball({0, 0, 0}, 1, 0);
  lift.kinematic = true;
  lift.velocity = {0, 1, 0};
  World world = world_with({lift, test::ground()});
  for (const BodyId id : world.bodies()) {
    world.set_mass(id, 0);
    world.set_inertia(id, diagonal({1, 1, 1}));
    world.set_acceleration(id, {5, 5, 5});
    world.set_damping(id, 0.5_r, 0.5_r);
    EXPECT_EQ(world.inertia(id), diagonal({0, 0, 0}));
    EXPECT_EQ(complaint([&] { world.set_mass(id, 2); }),
              "mass is 2; it must be 0 for an immovable or kinematic body");
  }
  for (int n = 0; n < 60; ++n) world.step();
  EXPECT_NEAR(world.states()[0].position.y, 1, 1e-4);
  EXPECT_EQ(world.states()[0].velocity, lift.velocity);
  EXPECT_EQ(world.states()[1].position, Vec3{});
}

TEST_P(Property, OutOfRangeIsAnErrorThatNamesValueAndRangeAndChangesNothing) {
  World world = world_with({resting_box({0, 0, 0})});
  const BodyId id = world.bodies()[0];
  const Mat3 inertia = world.inertia(id);
  EXPECT_EQ(complaint([&] { world.set_mass(id, 0); }),
            "mass is 0; it must be > 0 for a movable body");
  EXPECT_EQ(complaint([&] { world.set_mass(id, -1); }), "mass is -1; it must be finite and >= 0");
  EXPECT_NE(complaint([&] { world.set_mass(id, kNan); }), "");
  EXPECT_NE(complaint([&] { world.set_mass(id, kInfinity); }), "");
  EXPECT_NE(complaint([&] { world.set_mass(id, std::numeric_limits<Real>::denorm_min()); }), "");
  EXPECT_EQ(complaint([&] {
              world.set_inertia(id, diagonal({1, 1, 3}));
            }).find("inertia is ("),
            0u);
  EXPECT_NE(complaint([&] { world.set_inertia(id, diagonal({1, 0, 1})); }), "");
  EXPECT_NE(complaint([&] { world.set_inertia(id, diagonal({1, 1, kNan})); }), "");
  EXPECT_EQ(complaint([&] { world.set_friction(id, -1); }),
            "friction is -1; it must be finite and >= 0");
  EXPECT_NE(complaint([&] { world.set_friction(id, kInfinity); }), "");
  EXPECT_EQ(complaint([&] { world.set_restitution(id, 2); }),
            "restitution is 2; it must be in [0, 1]");
  EXPECT_NE(complaint([&] { world.set_restitution(id, kNan); }), "");
  EXPECT_EQ(complaint([&] {
              world.set_acceleration(id, {0, kInfinity, 0});
            }),
            "acceleration is (0, inf, 0); it must be finite");
  EXPECT_EQ(complaint([&] { world.set_damping(id, 0, 1); }),
            "linear_damping is 0; it must be in (0, 1]");
  EXPECT_EQ(complaint([&] { world.set_damping(id, 1, 1.5_r); }),
            "angular_damping is 1.5; it must be in (0, 1]");
  EXPECT_EQ(world.mass(id), 1);
  EXPECT_EQ(world.inertia(id), inertia);
  EXPECT_EQ(world.friction(id), 0.5_r);
  EXPECT_EQ(world.restitution(id), 0);
  EXPECT_EQ(world.acceleration(id), (Vec3{0, -9.81_r, 0}));
  EXPECT_EQ(world.linear_damping(id), 1);
  EXPECT_EQ(world.angular_damping(id), 1);
}

TEST_P(Property, AMassWhoseSolidHasNoFiniteInertiaNeedsAGivenInertia) {
  const Real tiny = square_root(std::numeric_limits<Real>::min());
  BodyDef def = test::ball({0, 0, 0}, tiny, 1e6_r);
  def.inertia = Mat3{};
  World world = world_with({def});
  const BodyId id = world.bodies()[0];
  world.set_mass(id, std::numeric_limits<Real>::min());
  EXPECT_EQ(complaint([&] { world.set_inertia(id, std::nullopt); }).find("moment of inertia is "),
            0u);
  EXPECT_EQ(world.inertia(id), Mat3{});
}

TEST_P(Property, OfARemovedBodyIsAnErrorAndNotInherited) {
  BodyDef def = test::ball({0, 0, 0});
  def.user_data = 5;
  def.inertia = diagonal({2, 2, 2});
  World world = world_with({def});
  const BodyId gone = world.bodies()[0];
  world.remove(gone);
  const BodyId fresh = world.add(test::ball({0, 0, 0}));
  ASSERT_EQ(fresh.index, gone.index);
  EXPECT_EQ(world.user_data(fresh), 0u);
  world.set_mass(fresh, 10);
  EXPECT_NEAR(world.inertia(fresh)(0, 0), 4, 1e-6);
  for (const auto& call : std::vector<std::function<void()>>{
           [&] { world.inertia(gone); }, [&] { world.set_mass(gone, 1); },
           [&] { world.set_inertia(gone, Mat3{}); }, [&] { world.friction(gone); },
           [&] { world.set_friction(gone, 1); }, [&] { world.restitution(gone); },
           [&] { world.set_restitution(gone, 1); }, [&] { world.acceleration(gone); },
           [&] { world.set_acceleration(gone, {}); }, [&] { world.linear_damping(gone); },
           [&] { world.angular_damping(gone); }, [&] { world.set_damping(gone, 1, 1); },
           [&] { world.user_data(gone); }, [&] { world.set_user_data(gone, 1); },
           [&] { world.sensor(gone); }, [&] { world.motion_locks(gone); },
           [&] { world.set_motion_locks(gone, {}); }}) {
    EXPECT_NE(complaint(call).find("body id (index 0, generation 0) is unknown"),
              std::string::npos);
  }
}

}  // namespace
}  // namespace jfpx
