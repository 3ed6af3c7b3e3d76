/// Tests of locked axes of motion: the motion is exactly 0 along and about them, and otherwise that
/// of mechanics.
#include "tests/world/random_bodies.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

namespace jfpx {
namespace {

using test::operator""_r;
using test::fresh_seed;
using test::trace;

constexpr MotionLocks kRotationAboutZ{.angular_x = true, .angular_y = true};
/// A body without gravity, damping, friction and sleep.
BodyDef floating(const Shape& shape, const Vec3& position, const MotionLocks& locks = {}) {
  BodyDef def = test::ball(position);
  def.shape = shape;
  def.motion_locks = locks;
  return def;
}

struct Matrix {
  double rows[3][3];
  double* operator[](int i) { return rows[i]; }
  const double* operator[](int i) const { return rows[i]; }
};

Matrix to_double(const Mat3& m) {
  Matrix result{};
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) result[i][k] = static_cast<double>(m(i, k));
  }
  return result;
}

/// The inertia of a body in world axes.
Matrix world_inertia(const World& world, BodyId id) {
  const Matrix body = to_double(world.inertia(id));
  const Quat q = world.state(id).orientation;
  const double w = q.w, x = q.x, y = q.y, z = q.z;
  const Matrix r{{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                  {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                  {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}}};
  Matrix result{};
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      for (int m = 0; m < 3; ++m) {
        for (int n = 0; n < 3; ++n) result[i][k] += r[i][m] * body[m][n] * r[k][n];
      }
    }
  }
  return result;
}

/// Expects that an inverse inertia is the inverse of the free rows and columns of an inertia.
void expect_inverse(const Mat3& inverse, const Matrix& inertia,
                    const std::array<bool, 3>& locked_axes) {
  const bool* const locked = locked_axes.data();
  const Matrix j = to_double(inverse);
  double largest = 0;
  for (int i = 0; i < 3; ++i) largest = std::max(largest, j[i][i]);
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      if (locked[i] || locked[k]) {
        EXPECT_EQ(j[i][k], 0);
        continue;
      }
      double product = 0, scale = 0;
      for (int m = 0; m < 3; ++m) {
        if (locked[m]) continue;
        product += j[i][m] * inertia[m][k];
        scale += largest * std::abs(inertia[m][k]);
      }
      EXPECT_NEAR(product, i == k ? 1 : 0, 100 * test::kEps * scale) << i << ", " << k;
    }
  }
}

TEST(MotionLocks, InverseInertiaIsTheInverseOfTheFreePart) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  for (int n = 0; n < 300; ++n) {
    BodyDef def = floating(Box{random.uniform_in_box({0.1_r, 0.1_r, 0.1_r}, {1, 1, 1})}, {});
    if (n % 5 == 1) def.shape = test::random_compound(&random);
    if (n % 5 == 2) def.shape = Sphere{random.uniform(0.1_r, 2)};
    if (n % 5 == 3) def.shape = Capsule{0.02_r, random.uniform(0.1_r, 1)};
    def.orientation = test::random_rotation(&random);
    const std::array<bool, 3> locked{random.below(2) == 0, random.below(2) == 0,
                                     random.below(2) == 0};
    def.motion_locks = {.angular_x = locked[0], .angular_y = locked[1], .angular_z = locked[2]};
    Scene scene;
    scene.bodies.push_back(def);
    World world(scene);
    const BodyId id = world.bodies()[0];
    expect_inverse(world.inverse_inertia(id), world_inertia(world, id), locked);
    if (testing::Test::HasFailure()) return;
  }
}

/// Rounding must not make the inverse inertia of a needle indefinite: contacts would explode.
TEST(MotionLocks, InverseInertiaOfANeedleIsNotNegative) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  for (int n = 0; n < 200; ++n) {
    Scene scene;
    BodyDef def = floating(Capsule{0.0005_r, 10}, {});
    def.orientation = test::random_rotation(&random);
    const std::uint64_t kind = random.below(3);
    def.motion_locks = {.angular_x = kind == 0, .angular_y = kind == 1, .angular_z = kind == 2};
    if (random.below(2) == 0) def.motion_locks.angular_x = true;
    scene.bodies.push_back(def);
    World world(scene);
    const Mat3 inverse = world.inverse_inertia(world.bodies()[0]);
    for (int k = 0; k < 20; ++k) {
      const Vec3 u = test::random_direction(&random);
      ASSERT_GE(dot(u, inverse * u), -4 * kEpsilon * length(inverse * u));
    }
  }
}

TEST(MotionLocks, ABodyWithoutRotationKeepsTheBitsOfItsOrientation) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  for (const bool any_friction : {false, true}) {
    Scene scene;
    scene.bodies.push_back(test::ground());
    BodyDef capsule = floating(Capsule{0.4_r, 0.5_r}, {0, 1.5_r, 0}, kFixedRotation);
    capsule.orientation = test::random_rotation(&random);
    capsule.acceleration = {0, -9.81_r, 0};
    scene.bodies.push_back(capsule);
    for (int i = 0; i < 12; ++i) {
      BodyDef box =
          floating(Box{{0.3_r, 0.2_r, 0.25_r}}, random.uniform_in_box({-3, 1, -3}, {3, 3, 3}));
      box.orientation = test::random_rotation(&random);
      box.velocity = (capsule.position - box.position) * 4;
      box.acceleration = {0, -9.81_r, 0};
      scene.bodies.push_back(box);
    }
    for (BodyDef& def : scene.bodies) def.friction = any_friction ? 0.7_r : 0;
    World world(scene);
    const BodyId id = world.bodies()[1];
    const BodyState start = world.state(id);
    for (int n = 0; n < 200; ++n) {
      world.apply_torque(id, {3, -2, 5});
      world.step();
      const BodyState state = world.state(id);
      ASSERT_EQ(state.orientation, start.orientation) << n;
      ASSERT_EQ(state.angular_velocity, Vec3{}) << n;
    }
    EXPECT_GT(length(world.state(id).position - start.position), 0.1_r);
  }
}

/// A blow beside the centre of mass gives a body that does not rotate the momentum of a particle.
TEST(MotionLocks, ABlowOnABodyWithoutRotationIsThatOnAParticle) {
  constexpr double kE = 0.5, kBall = 2, kBox = 3, kSpeed = 4;
  for (const bool is_locked : {true, false}) {
    BodyDef ball = test::ball({-2, 0.7_r, 0}, 0.2_r, static_cast<Real>(kBall));
    ball.velocity = {static_cast<Real>(kSpeed), 0, 0};
    ball.restitution = static_cast<Real>(kE);
    BodyDef box = floating(Box{{1, 1, 1}}, {}, is_locked ? kFixedRotation : MotionLocks{});
    box.mass = static_cast<Real>(kBox);
    box.restitution = static_cast<Real>(kE);
    Scene scene;
    scene.bodies = {ball, box};
    World world(scene);
    for (int n = 0; n < 60; ++n) world.step();
    const double mean = kBall * kSpeed / (kBall + kBox), difference = kE * kSpeed;
    const double of_box = mean + difference * kBall / (kBall + kBox);
    const double found = static_cast<double>(world.states()[1].velocity.x);
    if (is_locked) {
      EXPECT_NEAR(found, of_box, 1e-5 * kSpeed);
      EXPECT_NEAR(static_cast<double>(world.states()[0].velocity.x),
                  mean - difference * kBox / (kBall + kBox), 1e-5 * kSpeed);
    } else {
      EXPECT_LT(found, 0.9 * of_box);
    }
  }
}

TEST(MotionLocks, ASphereThatCannotRollSlidesUntilFrictionHasStoppedIt) {
  constexpr double kSpeed = 3, kFriction = 0.4;
  for (const MotionLocks& locks : {kFixedRotation, MotionLocks{.angular_z = true}}) {
    BodyDef sphere = test::heavy({0, 1, 0});
    sphere.motion_locks = locks;
    sphere.velocity = {static_cast<Real>(kSpeed), 0, 0};
    BodyDef ground = test::ground();
    sphere.friction = ground.friction = static_cast<Real>(kFriction);
    Scene scene;
    scene.bodies = {sphere, ground};
    World world(scene);
    for (int n = 0; n < 120; ++n) world.step();
    const BodyState state = world.states()[0];
    EXPECT_NEAR(static_cast<double>(state.position.x), kSpeed * kSpeed / (2 * kFriction * test::kG),
                0.02);
    EXPECT_LT(length(state.velocity), 1e-4_r);
    EXPECT_EQ(state.angular_velocity.z, 0);
    EXPECT_EQ(state.position.z, 0);
  }
}

/// A sphere that rotates about z alone rolls like any other, and rolling friction stops it.
TEST(MotionLocks, ASphereThatRotatesAboutOneAxisRollsLikeAnyOther) {
  std::vector<BodyState> ends;
  for (const MotionLocks& locks : {MotionLocks{}, kRotationAboutZ, kPlanarMotion}) {
    BodyDef sphere = test::heavy({0, 0.5_r, 0});
    sphere.shape = Sphere{0.5_r};
    sphere.motion_locks = locks;
    sphere.velocity = {2, 0, 0};
    sphere.angular_velocity = {0, 0, -4};
    sphere.friction = 1;
    sphere.rolling_friction = 0.02_r;
    Scene scene;
    scene.bodies = {sphere, test::ground()};
    scene.bodies[1].friction = 1;
    World world(scene);
    for (int n = 0; n < 60; ++n) world.step();
    ends.push_back(world.states()[0]);
  }
  EXPECT_LT(ends[0].velocity.x, 1.9_r);
  for (const BodyState& end : ends) {
    EXPECT_NEAR(end.position.x, ends[0].position.x, 1e-3_r);
    EXPECT_NEAR(end.angular_velocity.z, ends[0].angular_velocity.z, 1e-3_r);
  }
}

/// The moment of inertia of a rotation about z is the entry of the tensor. The inverse of the entry
/// of the inverse tensor would be smaller: the axis is not a principal axis.
TEST(MotionLocks, APendulumAboutALockedAxisHasThePeriodOfItsMoment) {
  BodyDef box = floating(Box{{0.6_r, 0.2_r, 0.1_r}}, {0.3_r, -1, 0}, kRotationAboutZ);
  box.orientation = normalized(Quat{0.8_r, 0.3_r, 0.5_r, 0.2_r});
  box.acceleration = {0, -9.81_r, 0};
  box.mass = 2;
  Scene scene;
  scene.soft_step.substeps = 8;
  scene.bodies = {box};
  World world(scene);
  const BodyId id = world.bodies()[0];
  BallJoint joint;
  joint.a = id;
  joint.anchor_a = to_local_point(world.state(id), {});
  world.add_joint(joint);
  const double m = 2, r = std::hypot(0.3, 1.0);
  const double moment = world_inertia(world, id)[2][2] + m * r * r;
  ASSERT_GT(std::abs(world_inertia(world, id)[2][0]) + std::abs(world_inertia(world, id)[2][1]),
            0.05);
  double angle = std::atan2(0.3, 1.0), rate = 0;
  const int steps = 180, parts = 1000;
  for (int n = 0; n < steps; ++n) {
    world.step();
    const double h = static_cast<double>(scene.dt) / parts;
    for (int k = 0; k < parts; ++k) {
      rate -= h * m * test::kG * r * std::sin(angle) / moment;
      angle += h * rate;
    }
    const BodyState state = world.state(id);
    const double found =
        std::atan2(static_cast<double>(state.position.x), -static_cast<double>(state.position.y));
    ASSERT_NEAR(found, angle, 0.01) << n;
    ASSERT_EQ(state.angular_velocity.x, 0);
    ASSERT_EQ(state.angular_velocity.y, 0);
  }
}

TEST(MotionLocks, ForcesTorquesAndImpulsesActAlongFreeAxesOnly) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  BodyDef box = floating(Box{{0.6_r, 0.2_r, 0.1_r}}, {1, 2, 3},
                         {.linear_x = true, .linear_z = true, .angular_x = true});
  box.orientation = test::random_rotation(&random);
  box.acceleration = {1, 0, 1};
  box.velocity = {7, 1, 7};
  box.angular_velocity = {7, 1, 2};
  Scene scene;
  scene.bodies = {box};
  World world(scene);
  const BodyId id = world.bodies()[0];
  const auto expect_locked = [&] {
    const BodyState state = world.state(id);
    EXPECT_EQ(state.velocity.x, 0);
    EXPECT_EQ(state.velocity.z, 0);
    EXPECT_EQ(state.position.x, 1);
    EXPECT_EQ(state.position.z, 3);
    EXPECT_EQ(state.angular_velocity.x, 0);
  };
  expect_locked();
  EXPECT_EQ(world.state(id).velocity.y, 1);
  EXPECT_EQ(world.state(id).angular_velocity, (Vec3{0, 1, 2}));
  world.apply_impulse(id, {3, 4, 5});
  world.apply_angular_impulse(id, {0.1_r, 0.2_r, 0.3_r});
  world.apply_impulse_at_point(id, {1, 1, 1}, {2, 2, 2});
  expect_locked();
  EXPECT_EQ(world.state(id).velocity.y, 6);
  EXPECT_NE(world.state(id).angular_velocity.y, 1);
  for (int n = 0; n < 30; ++n) {
    world.apply_force_at_point(id, {5, 6, 7}, {1, 1, 1});
    world.apply_torque(id, {1, 1, 1});
    world.step();
    ASSERT_NO_FATAL_FAILURE(expect_locked()) << n;
  }
  EXPECT_EQ(world.last_acceleration(id), (Vec3{0, 6, 0}));
  BodyState state = world.state(id);
  state.velocity = state.angular_velocity = {1, 1, 1};
  world.set_state(id, state);
  EXPECT_EQ(world.state(id).velocity, (Vec3{0, 1, 0}));
  EXPECT_EQ(world.state(id).angular_velocity, (Vec3{0, 1, 1}));
}

TEST(MotionLocks, CanBeChangedAndHaveTheBitsOfADefinition) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  for (int n = 0; n < 40; ++n) {
    Scene scene;
    scene.sleep.speed = 0;  // a change wakes the body
    for (int i = 0; i < 6; ++i) {
      BodyDef def = test::random_body(&random, 1);
      if (!test::has_volume(def.shape)) def.shape = Sphere{0.3_r};
      def.velocity = def.mass > 0 ? Vec3{1, 2, 3} : Vec3{};
      def.angular_velocity = def.mass > 0 ? Vec3{3, 2, 1} : Vec3{};
      def.motion_locks = test::random_locks(&random);
      scene.bodies.push_back(def);
    }
    World defined(scene);
    std::vector<MotionLocks> locks;
    for (BodyDef& def : scene.bodies) {
      locks.push_back(def.motion_locks);
      def.motion_locks = test::random_locks(&random);
      // Locks end the velocities that the definition has.
      def.velocity = def.angular_velocity = {};
    }
    World changed(scene);
    for (std::size_t i = 0; i < locks.size(); ++i) {
      const BodyId id = changed.bodies()[i];
      changed.set_motion_locks(id, locks[i]);
      const bool is_movable = scene.bodies[i].mass > 0;
      EXPECT_EQ(changed.motion_locks(id), is_movable ? locks[i] : MotionLocks{});
      if (!is_movable) continue;
      const BodyState start = defined.state(id);
      for (World* world : {&defined, &changed}) world->set_state(id, start);
    }
    EXPECT_EQ(changed.snapshot(), defined.snapshot());
    for (int k = 0; k < 20; ++k) {
      defined.step();
      changed.step();
      ASSERT_EQ(changed.state_hash(), defined.state_hash()) << n << ", " << k;
    }
  }
}

TEST(MotionLocks, ANewLockEndsTheMotionAndWakesTheBody) {
  Scene scene;
  BodyDef box = floating(Box{{1, 1, 1}}, {0, 1, 0});
  box.acceleration = {0, -9.81_r, 0};
  box.can_sleep = true;
  scene.bodies = {box, test::ground()};
  World world(scene);
  const BodyId id = world.bodies()[0];
  for (int n = 0; n < 100; ++n) world.step();
  ASSERT_FALSE(world.awake(id));
  world.set_motion_locks(id, {});
  EXPECT_FALSE(world.awake(id)) << "by the locks that it has";
  world.set_motion_locks(id, kPlanarMotion);
  EXPECT_TRUE(world.awake(id));
  world.set_state(id, {{0, 3, 0}, {}, {1, 2, 3}, {1, 2, 3}});
  world.set_motion_locks(id, {.linear_x = true, .angular_z = true});
  EXPECT_EQ(world.state(id).velocity, (Vec3{0, 2, 0}));
  EXPECT_EQ(world.state(id).angular_velocity, (Vec3{0, 0, 0}));
}

/// A frictionless, inelastic blow on a body that moves along one line.
TEST(MotionLocks, ABlowAcrossALockedAxisEndsWithEqualSpeedsAlongTheNormal) {
  for (const double mass : {0.2, 1.0, 5.0}) {
    const double half = std::sqrt(0.5), speed = 3;
    BodyDef target = test::ball({}, 1, static_cast<Real>(mass));
    target.motion_locks = {.linear_y = true, .linear_z = true};
    BodyDef shot = test::ball({-2.2_r, 0, -2.2_r});
    const Real along = static_cast<Real>(speed * half);
    shot.velocity = {along, 0, along};
    Scene scene;
    scene.bodies = {target, shot};
    World world(scene);
    for (int n = 0; n < 60; ++n) {
      world.step();
      ASSERT_EQ(world.states()[0].position.z, 0);
      ASSERT_EQ(world.states()[0].velocity.z, 0);
    }
    // The target moves along x only; the shot, in the direction of the blow.
    const double response = 1 + half * half / mass, impulse = speed / response;
    EXPECT_NEAR(static_cast<double>(world.states()[0].velocity.x), impulse * half / mass,
                0.02 * speed)
        << mass;
    EXPECT_NEAR(static_cast<double>(length(world.states()[1].velocity)), speed - impulse,
                0.02 * speed)
        << mass;
  }
}

/// Boxes, balls and capsules in a plane stay there, and fall asleep.
TEST(MotionLocks, AHeapInAPlaneStaysThereAndFallsAsleep) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  Scene scene;
  const Shape shapes[] = {Box{{0.4_r, 0.3_r, 0.5_r}}, Sphere{0.4_r}, Capsule{0.2_r, 0.3_r}};
  for (int i = 0; i < 30; ++i) {
    BodyDef def = floating(
        shapes[i % 3], {random.uniform(-1.5_r, 1.5_r), static_cast<Real>(i) + 1, 0}, kPlanarMotion);
    // Deeper bodies are not in the middle of the others.
    def.position.z = random.uniform(-0.2_r, 0.2_r);
    def.acceleration = {0, -9.81_r, 0};
    def.can_sleep = true;
    def.friction = 0.5_r;
    def.rolling_friction = 0.02_r;
    def.angular_damping = 0.5_r;
    scene.bodies.push_back(def);
  }
  scene.bodies.push_back(test::ground());
  scene.bodies.push_back(test::half_space({1, 0, 0}, -2));
  scene.bodies.push_back(test::half_space({-1, 0, 0}, -2));
  World world(scene);
  std::uint32_t awake = 30;
  for (int n = 0; n < 1500 && awake > 0; ++n) {
    awake = world.step().awake;
    for (std::size_t i = 0; i < 30; ++i) {
      const BodyState state = world.states()[i];
      ASSERT_EQ(state.position.z, scene.bodies[i].position.z);
      ASSERT_EQ(state.velocity.z, 0);
      ASSERT_EQ(state.orientation.x, 0);
      ASSERT_EQ(state.orientation.y, 0);
      ASSERT_EQ(state.angular_velocity, (Vec3{0, 0, state.angular_velocity.z}));
      ASSERT_GT(state.position.y, 0);
      ASSERT_LT(absolute(state.position.x), 2);
    }
  }
  EXPECT_EQ(awake, 0u);
}

/// The points of a contact of boxes that do not tilt act alike. Together, they must not be stiffer
/// than those of other boxes, or pyramids oscillate.
TEST(MotionLocks, PyramidsOfBoxesThatDoNotTiltStand) {
  constexpr int kRows = 15;
  for (const MotionLocks& locks : {kPlanarMotion, kFixedRotation}) {
    Scene scene;
    for (int row = 0; row < kRows; ++row) {
      for (int i = 0; i < kRows - row; ++i) {
        BodyDef box = floating(Box{{0.5_r, 0.5_r, 0.5_r}}, {}, locks);
        box.position = {1.02_r * static_cast<Real>(i) + 0.51_r * static_cast<Real>(row),
                        0.5_r + static_cast<Real>(row), 0};
        box.acceleration = {0, -9.81_r, 0};
        box.friction = 0.5_r;
        scene.bodies.push_back(box);
      }
    }
    scene.bodies.push_back(test::ground());
    World world(scene);
    for (int n = 0; n < 300; ++n) world.step();
    const std::vector<BodyState> states = world.states();
    for (std::size_t i = 0; i + 1 < states.size(); ++i) {
      EXPECT_LT(length(states[i].velocity), 0.01_r) << i;
      EXPECT_LT(length(states[i].position - scene.bodies[i].position), 0.03_r) << i;
    }
  }
}

/// Locks of all axes hold a body like mass 0, also under a much heavier one.
TEST(MotionLocks, ABodyWithAllAxesLockedCarriesOthers) {
  for (const Real mass : {0.2_r, 1.0_r, 1000.0_r}) {
    Scene scene;
    BodyDef plank = floating(Box{{2, 0.1_r, 2}}, {0, 3, 0}, kFixedPose);
    plank.acceleration = {0, -9.81_r, 0};
    plank.can_sleep = true;
    plank.friction = 0.5_r;
    BodyDef box = plank;
    box.shape = Box{{0.5_r, 0.5_r, 0.5_r}};
    box.motion_locks = {};
    box.position = {1, 3.6_r, 1};
    box.mass = mass;
    scene.bodies = {plank, box};
    World world(scene);
    std::uint32_t awake = 2;
    for (int n = 0; n < 300; ++n) awake = world.step().awake;
    EXPECT_EQ(awake, 0u) << mass;
    EXPECT_EQ(world.states()[0].position, plank.position);
    EXPECT_EQ(world.states()[0].orientation, plank.orientation);
    EXPECT_LT(length(world.states()[1].position - box.position), 0.02_r) << mass;
  }
}

/// Joints of bodies in a plane: with any axes, also such that the joint locks, drives or limits
/// rotations that the bodies do not have. Energy is not gained from the locks.
TEST(MotionLocks, JointsOfBodiesInAPlaneGainNoEnergy) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  for (int k = 0; k < 60; ++k) {
    Scene scene;
    const std::uint64_t kind = random.below(4);
    for (int i = 0; i < 5; ++i) {
      BodyDef def = floating(Box{{0.5_r, 0.1_r, 0.3_r}}, {static_cast<Real>(i), 0, 0},
                             random.below(4) == 0 ? kFixedRotation : kPlanarMotion);
      def.motion_locks.linear_z = true;
      def.acceleration = {0, -9.81_r, 0};
      scene.bodies.push_back(def);
    }
    World world(scene);
    for (std::size_t i = 0; i < 5; ++i) {
      const BodyId a = world.bodies()[i];
      const Vec3 at{static_cast<Real>(i) - 0.5_r, 0, 0};
      const auto place = [&](auto joint) {
        joint.a = a;
        if (i > 0) joint.b = world.bodies()[i - 1];
        const BodyState other = i > 0 ? world.state(*joint.b) : BodyState{};
        joint.anchor_a = to_local_point(world.state(a), at);
        joint.anchor_b = to_local_point(other, at);
        if constexpr (requires { joint.axes_a; }) {
          joint.axes_a = joint.axes_b = test::random_rotation(&random);
        }
        world.add_joint(joint);
      };
      if (kind == 0) place(FixedJoint{});
      if (kind == 1) place(BallJoint{.cone_angle = 0.5_r, .min_twist = -0.2_r, .max_twist = 0.2_r});
      if (kind == 2) place(HingeJoint{.min_angle = -0.3_r, .max_angle = 0.3_r});
      if (kind == 3) place(SliderJoint{.min_position = -0.5_r, .max_position = 0.5_r});
    }
    for (int n = 0; n < 300; ++n) {
      ASSERT_FALSE(world.step().non_finite);
      for (std::size_t i = 0; i < 5; ++i) {
        const BodyState state = world.states()[i];
        ASSERT_EQ(state.position.z, 0);
        // From rest, a fall by the length of the chain.
        ASSERT_LT(length(state.velocity), 20) << "kind " << kind << ", step " << n;
        ASSERT_LT(absolute(state.angular_velocity.z), 60) << "kind " << kind << ", step " << n;
      }
    }
  }
}

TEST(MotionLocks, OfAnImmovableBodyHaveNoEffect) {
  Scene scene;
  BodyDef def = floating(Box{{1, 1, 1}}, {}, kFixedPose);
  def.mass = 0;
  scene.bodies = {def};
  World world(scene);
  const BodyId id = world.bodies()[0];
  EXPECT_EQ(world.motion_locks(id), MotionLocks{});
  world.set_motion_locks(id, kFixedPose);
  EXPECT_EQ(world.motion_locks(id), MotionLocks{});
}

}  // namespace
}  // namespace jfpx
