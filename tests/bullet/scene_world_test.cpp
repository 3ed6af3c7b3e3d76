/// Conversion of a scene to Bullet.
#include <jfpx/bullet/scene_world.hpp>
#include <jfpx/bullet/verify.hpp>
#include <jfpx/error.hpp>
#include <jfpx/world.hpp>

#include "tests/bullet/twin_worlds.hpp"

#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

BodyDef ball(const Vec3& position, Real radius = Real(0.5)) {
  BodyDef def;
  def.shape = Sphere{radius};
  def.position = position;
  return def;
}

TEST(SceneWorld, OfAnEmptySceneSteps) {
  SceneWorld world{Scene{}};
  world.step();
  EXPECT_TRUE(world.states().empty());
}

TEST(SceneWorld, KeepsOrderAndStartStates) {
  Scene scene;
  scene.bodies = {ball({1, 2, 3}), ball({4, 5, 6}), ball({7, 8, 9})};
  scene.bodies[1].velocity = {1, 0, 0};
  scene.bodies[1].angular_velocity = {0, 2, 0};
  SceneWorld world(scene);
  const std::vector<BodyState> states = world.states();
  ASSERT_EQ(states.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(states[i].position, scene.bodies[i].position);
  EXPECT_EQ(states[1].velocity, scene.bodies[1].velocity);
  EXPECT_EQ(states[1].angular_velocity, scene.bodies[1].angular_velocity);
  EXPECT_EQ(states[0].orientation, Quat{});
}

TEST(SceneWorld, FallsByItsOwnAcceleration) {
  // Bullet integrates semi-implicitly: after n steps v = g n dt, y = g dt^2 n (n+1) / 2.
  Scene scene;
  scene.bodies = {ball({0, 0, 0}), ball({10, 0, 0})};
  scene.bodies[0].acceleration = {0, Real(-10), 0};
  scene.bodies[1].acceleration = {Real(3), 0, 0};
  scene.dt = Real(0.015625);
  SceneWorld world(scene);
  for (int i = 0; i < 32; ++i) world.step();
  const std::vector<BodyState> states = world.states();
  const double dt = 0.015625;
  EXPECT_NEAR(states[0].velocity.y, -10 * 32 * dt, 1e-5);
  EXPECT_NEAR(states[0].position.y, -10 * dt * dt * 32 * 33 / 2, 1e-5);
  EXPECT_NEAR(states[1].velocity.x, 3 * 32 * dt, 1e-5);
  EXPECT_EQ(states[1].velocity.y, 0);
}

TEST(SceneWorld, DampsByShareKeptPerSecond) {
  Scene scene;
  scene.bodies = {ball({0, 0, 0})};
  scene.bodies[0].acceleration = {};
  scene.bodies[0].velocity = {8, 0, 0};
  scene.bodies[0].angular_velocity = {0, 0, 4};
  scene.bodies[0].linear_damping = Real(0.5);
  scene.bodies[0].angular_damping = Real(0.25);
  scene.dt = Real(1) / 64;
  SceneWorld world(scene);
  for (int i = 0; i < 64; ++i) world.step();
  EXPECT_NEAR(world.states()[0].velocity.x, 4, 1e-4);
  EXPECT_NEAR(world.states()[0].angular_velocity.z, 1, 1e-4);
}

TEST(SceneWorld, CombinesFrictionAndRestitutionByTheRuleOfTheScene) {
  // sqrt(0.81 * 0.25) = 0.45 and sqrt(0.36 * 0.64) = 0.48
  Scene scene;
  scene.bodies = {ball({0, 0, 0}), ball({Real(0.9), 0, 0})};
  scene.bodies[0].friction = Real(0.81);
  scene.bodies[1].friction = Real(0.25);
  scene.bodies[0].restitution = Real(0.36);
  scene.bodies[1].restitution = Real(0.64);
  SceneWorld world(scene);
  world.step();
  ASSERT_EQ(world.dispatcher().getNumManifolds(), 1);
  const btPersistentManifold& manifold = *world.dispatcher().getManifoldByIndexInternal(0);
  ASSERT_EQ(manifold.getNumContacts(), 1);
  EXPECT_NEAR(manifold.getContactPoint(0).m_combinedFriction, 0.45, 1e-6);
  EXPECT_NEAR(manifold.getContactPoint(0).m_combinedRestitution, 0.48, 1e-6);
}

TEST(SceneWorld, MultipliesForTheProductRuleAndRejectsOtherRules) {
  Scene scene;
  scene.bodies = {ball({0, 0, 0}), ball({Real(0.9), 0, 0})};
  scene.bodies[0].friction = scene.bodies[0].restitution = Real(0.5);
  scene.bodies[1].friction = scene.bodies[1].restitution = Real(0.25);
  scene.materials = {CombineRule::product, CombineRule::product};
  SceneWorld world(scene);
  world.step();
  const btPersistentManifold& manifold = *world.dispatcher().getManifoldByIndexInternal(0);
  EXPECT_EQ(manifold.getContactPoint(0).m_combinedFriction, Real(0.125));
  EXPECT_EQ(manifold.getContactPoint(0).m_combinedRestitution, Real(0.125));

  for (const CombineRule rule :
       {CombineRule::minimum, CombineRule::maximum, CombineRule::average}) {
    scene.materials = {CombineRule::product, rule};
    try {
      SceneWorld refused(scene);
      ADD_FAILURE() << to_string(rule);
    } catch (const InvalidScene& error) {
      EXPECT_EQ(error.what(), std::string("scene: materials.restitution is ") + to_string(rule) +
                                  "; it must be geometric_mean or product, because Bullet "
                                  "multiplies the coefficients of two bodies");
    }
    scene.materials = {rule, CombineRule::product};
    EXPECT_THROW(SceneWorld{scene}, InvalidScene);
  }
}

TEST(SceneWorld, AKinematicBodyMovesByItsVelocitiesAndPushes) {
  Scene scene;
  scene.bodies = {ball({Real(0.9), 0, 0}), ball({0, 0, 0})};
  scene.bodies[0].acceleration = {};
  scene.bodies[1].mass = 0;
  scene.bodies[1].kinematic = true;
  scene.bodies[1].velocity = {2, 0, 0};
  scene.bodies[1].angular_velocity = {0, 0, 1};
  scene.dt = Real(1) / 64;
  SceneWorld world(scene);
  for (int i = 0; i < 64; ++i) world.step();
  const BodyState pusher = world.states()[1];
  EXPECT_NEAR(pusher.position.x, 2, 1e-5);
  EXPECT_NEAR(pusher.velocity.x, 2, 1e-3);
  EXPECT_NEAR(pusher.angular_velocity.z, 1, 1e-3);
  EXPECT_NEAR(pusher.orientation.z, std::sin(0.5), 1e-4);
  EXPECT_GT(world.states()[0].position.x, pusher.position.x + Real(0.9));
  EXPECT_GT(world.states()[0].velocity.x, Real(1.9));
}

/// Bullet gives the belt its velocity, although it keeps its pose.
TEST(SceneWorld, ConveyorsDriveBodiesAndKeepTheirPose) {
  Scene scene;
  scene.bodies = {ball({0, Real(0.2), 0}), ball({0, -1, 0})};
  scene.bodies[0].shape = Box{{Real(0.5), Real(0.2), Real(0.5)}};
  scene.bodies[1].shape = Box{{20, 1, 20}};
  scene.bodies[1].mass = 0;
  scene.bodies[1].kinematic = true;
  scene.bodies[1].velocity = {2, 0, 0};
  scene.bodies[1].motion_locks = kFixedPose;
  SceneWorld world(scene);
  for (int i = 0; i < 120; ++i) world.step();
  const BodyState belt = world.states()[1];
  EXPECT_EQ(belt.position, scene.bodies[1].position);
  EXPECT_EQ(belt.orientation, scene.bodies[1].orientation);
  EXPECT_NEAR(belt.velocity.x, 2, 1e-3);
  EXPECT_NEAR(world.states()[0].velocity.x, 2, 0.01);
  EXPECT_GT(world.states()[0].position.x, 3);

  // A tilted turntable.
  scene.bodies[1].orientation = normalized(Quat{1, Real(0.1), Real(0.2), Real(0.3)});
  scene.bodies[1].angular_velocity = {0, 1, 0};
  SceneWorld tilted(scene);
  const BodyState first = tilted.states()[1];
  for (int i = 0; i < 120; ++i) tilted.step();
  EXPECT_EQ(tilted.states()[1].orientation, first.orientation);
  EXPECT_NEAR(tilted.states()[1].angular_velocity.y, 1, 0.01);  // from an arc cosine
}

TEST(SceneWorld, AcceptsADiagonalInertiaAndRejectsAnyOther) {
  Scene scene;
  scene.bodies = {ball({0, 0, 0}), ball({9, 0, 0})};
  scene.bodies[1].inertia = diagonal({1, 2, Real(2.5)});
  SceneWorld world(scene);
  const btVector3 inverse = world.bodies()[1]->getInvInertiaDiagLocal();
  EXPECT_NEAR(inverse.x(), 1, 1e-6);
  EXPECT_NEAR(inverse.y(), 0.5, 1e-6);
  EXPECT_NEAR(inverse.z(), 0.4, 1e-6);
  scene.bodies[1].inertia = Mat3{{{1, Real(0.1), 0}, {Real(0.1), 1, 0}, {0, 0, 1}}};
  try {
    SceneWorld refused(scene);
    ADD_FAILURE();
  } catch (const InvalidScene& error) {
    EXPECT_STREQ(error.what(),
                 "body 1: inertia has products of inertia; it must be diagonal to run in Bullet");
  }
}

TEST(SceneWorld, PlanesAndBoxesHoldABall) {
  for (const bool plane : {true, false}) {
    Scene scene;
    scene.bodies = {ball({0, 1, 0})};
    BodyDef ground;
    ground.mass = 0;
    if (plane) {
      ground.shape = HalfSpace{{0, 1, 0}, Real(0.25)};
      ground.position = {3, 3, 3};  // a half-space ignores the pose
    } else {
      ground.shape = Box{{5, 1, 5}};
      ground.position = {0, Real(-0.75), 0};
    }
    scene.bodies.push_back(ground);
    SceneWorld world(scene);
    for (int i = 0; i < 240; ++i) world.step();
    EXPECT_NEAR(world.states()[0].position.y, 0.75, 0.01) << plane;
    EXPECT_EQ(world.states()[1].position, ground.position);
  }
}

/// Balls in the pits of a heightfield, where they touch triangles on both sides of each diagonal.
TEST(SceneWorld, HeightfieldsAreWhereTheNativeWorldHasThem) {
  for (const bool has_hole : {false, true}) {
    HeightfieldDef def{4, 5, Real(1.5), 1, std::vector<Real>(20, 3), {}, false};
    def.heights[5] = Real(2.5);   // row 1, column 1
    def.heights[14] = Real(2.4);  // row 3, column 2
    if (has_hole) def.holes = {9};
    const Heightfield ground(def);
    Scene scene;
    for (const Vec3& pit : {ground.vertex(1, 1), ground.vertex(3, 2)}) {
      scene.bodies.push_back(ball(pit + Vec3{Real(0.05), Real(0.6), Real(-0.03)}));
      scene.bodies.back().friction = 1;
      scene.bodies.back().rolling_friction = Real(0.01);
    }
    scene.bodies.push_back(ball(ground.vertex(2, 1) + Vec3{Real(0.75), 1, Real(0.5)}, Real(0.2)));
    BodyDef fixed;
    fixed.mass = 0;
    fixed.shape = ground;
    scene.bodies.push_back(fixed);
    SceneWorld world(scene);
    World native(scene);
    for (int i = 0; i < 240; ++i) {
      world.step();
      native.step();
    }
    const std::vector<BodyState> states = world.states();
    for (std::size_t i = 0; i < 2; ++i) {
      const Vec3 expected = native.state(native.bodies()[i]).position;
      EXPECT_LT(length(states[i].position - expected), Real(0.03)) << i;
    }
    const Real third = native.state(native.bodies()[2]).position.y;
    EXPECT_EQ(third < 0, has_hole);
    EXPECT_EQ(states[2].position.y < 0, has_hole);
  }
}

TEST(SceneWorld, ABallFallsThroughAHeightfieldOfHoles) {
  Scene scene;
  scene.bodies = {ball({0, 1, 0})};
  BodyDef fixed;
  fixed.mass = 0;
  fixed.shape = Heightfield({2, 3, 1, 1, std::vector<Real>(6, 0), {0, 2}, false});
  scene.bodies.push_back(fixed);
  SceneWorld world(scene);
  for (int i = 0; i < 120; ++i) world.step();
  EXPECT_LT(world.states()[0].position.y, -1);
}

/// Cylinders and cones, standing and lying, come to rest where they do in the native world.
TEST(SceneWorld, RoundSolidsRestWhereTheNativeWorldHasThem) {
  Scene scene;
  BodyDef ground;
  ground.mass = 0;
  ground.shape = Box{{5, 1, 5}};
  ground.position = {0, -1, 0};
  scene.bodies = {ground};
  const auto add = [&](const Shape& shape, const Vec3& position, const Quat& orientation) {
    BodyDef def = ball(position);
    def.shape = shape;
    def.orientation = orientation;
    scene.bodies.push_back(def);
  };
  add(Cylinder{Real(0.4), Real(0.6)}, {-2, Real(0.62), 0}, {});
  add(Cylinder{Real(0.4), Real(0.6)}, {2, Real(0.42), 0}, normalized(Quat{1, 1, 0, 0}));
  add(Cone{Real(0.4), Real(0.6)}, {0, Real(0.32), 2}, {});
  SceneWorld world(scene);
  World native(scene);
  for (int i = 0; i < 240; ++i) {
    world.step();
    native.step();
  }
  const std::vector<BodyState> states = world.states();
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
    const Vec3 expected = native.state(native.bodies()[i]).position;
    EXPECT_LT(length(states[i].position - expected), Real(0.02)) << i;
  }
}

/// An angle of two bars, whose inertia tensor is not diagonal.
BodyDef angle_iron(const Vec3& position) {
  BodyDef def = ball(position);
  def.shape = centred({{{.shape = Box{{Real(1.5), Real(0.5), Real(0.5)}}},
                        {.shape = Box{{Real(0.5), 1, Real(0.5)}},
                         .position = {-1, Real(1.5), 0},
                         .orientation = normalized(Quat{1, Real(0.2), 0, 0})}}});
  return def;
}

TEST(SceneWorld, CompoundsStartInTheirPosesWithTheInertiaOfTheNativeWorld) {
  Scene scene;
  scene.dt = Real(1) / 1024;
  scene.bodies = {angle_iron({1, 2, 3})};
  BodyDef& def = scene.bodies[0];
  def.acceleration = {};
  def.orientation = normalized(Quat{1, Real(0.5), Real(-0.25), 0});
  def.angular_velocity = {Real(0.3), Real(0.2), Real(0.1)};
  SceneWorld bullet(scene);
  const BodyState s = bullet.states()[0];
  EXPECT_EQ(s.position, def.position);
  EXPECT_NEAR(s.orientation.w, def.orientation.w, 1e-6);
  EXPECT_NEAR(s.orientation.x, def.orientation.x, 1e-6);
  EXPECT_NEAR(s.orientation.y, def.orientation.y, 1e-6);
  EXPECT_NEAR(s.orientation.z, def.orientation.z, 1e-6);

  // The same torque rotates both in the same way.
  World native(scene);
  const Vec3 torque{2, Real(-1), 3};
  native.apply_torque(native.bodies()[0], torque);
  bullet.bodies()[0]->applyTorque({torque.x, torque.y, torque.z});
  native.step();
  bullet.step();
  const Vec3 difference = native.states()[0].angular_velocity - bullet.states()[0].angular_velocity;
  EXPECT_NEAR(length(difference), 0, 2e-3);
}

TEST(SceneWorld, ACompoundComesToRestOnTheGround) {
  Scene scene;
  scene.bodies = {angle_iron({0, 2, 0})};
  BodyDef ground;
  ground.shape = HalfSpace{};
  ground.mass = 0;
  scene.bodies.push_back(ground);
  SceneWorld world(scene);
  for (int i = 0; i < 600; ++i) world.step();
  EXPECT_LT(length(world.states()[0].velocity), Real(0.01));
  EXPECT_GT(world.states()[0].position.y, Real(0.4));
  EXPECT_LT(world.states()[0].position.y, Real(1.5));
}

TEST(SceneWorld, ATwoSidedPlaneIsRejected) {
  Scene scene;
  scene.bodies = {ball({0, 0, 0}), ball({0, 0, 0})};
  scene.bodies[1].shape = Plane{};
  scene.bodies[1].mass = 0;
  try {
    SceneWorld world(scene);
    FAIL();
  } catch (const InvalidScene& error) {
    EXPECT_STREQ(error.what(),
                 "body 1: shape is a two-sided plane, which Bullet does not support; it must "
                 "be a half-space or a box to run in Bullet");
  }
}

TEST(SceneWorld, JointsAreRejected) {
  Scene scene;
  scene.bodies = {ball({0, 0, 0}), ball({3, 0, 0})};
  scene.joints = {DistanceJoint{.a = {0, 0}, .b = BodyId{1, 0}}};
  try {
    SceneWorld world(scene);
    FAIL();
  } catch (const InvalidScene& error) {
    EXPECT_STREQ(error.what(),
                 "scene: joints has 1 joints, which SceneWorld does not support; it must be empty "
                 "to run in Bullet");
  }
}

TEST(SceneWorld, PutsOnlyBodiesToSleepThatMaySleep) {
  for (const bool enabled : {true, false}) {
    Scene scene;
    scene.sleep.enabled = enabled;
    scene.bodies = {ball({0, 0, 0}), ball({10, 0, 0})};
    for (BodyDef& body : scene.bodies) body.acceleration = {};
    scene.bodies[1].can_sleep = false;
    SceneWorld world(scene);
    for (int i = 0; i < 300; ++i) world.step();
    EXPECT_EQ(world.bodies()[0]->isActive(), !enabled);
    EXPECT_TRUE(world.bodies()[1]->isActive());
  }
}

using Pairs = std::set<std::pair<std::uint32_t, std::uint32_t>>;

/// Pairs of scene bodies whose spheres touch after the last step.
Pairs touching_pairs(SceneWorld& world) {
  std::map<const btCollisionObject*, std::uint32_t> index;
  for (const btRigidBody* body : world.bodies()) {
    index.emplace(body, static_cast<std::uint32_t>(index.size()));
  }
  Pairs pairs;
  for (int i = 0; i < world.dispatcher().getNumManifolds(); ++i) {
    const btPersistentManifold& m = *world.dispatcher().getManifoldByIndexInternal(i);
    for (int k = 0; k < m.getNumContacts(); ++k) {
      if (m.getContactPoint(k).getDistance() > 0) continue;
      pairs.insert(std::minmax(index.at(m.getBody0()), index.at(m.getBody1())));
    }
  }
  return pairs;
}

/// A heap of balls, some of them immovable, with random filters and ignored pairs.
Scene filtered_heap(Random* random) {
  Scene scene;
  const auto category = [random] {
    constexpr std::uint32_t kCategories[] = {1, 2, 1u << 31};
    return kCategories[random->below(3)];
  };
  for (int i = 0; i < 60; ++i) {
    scene.bodies.push_back(
        ball(random->uniform_in_box({0, 1, 0}, {3, 4, 3}), random->uniform(Real(0.2), Real(0.6))));
    BodyDef& body = scene.bodies.back();
    if (random->below(5) == 0) body.mass = 0;
    body.sensor = random->below(8) == 0;
    if (random->below(2) == 0) body.filter = {category(), ~category()};
  }
  BodyDef ground;
  ground.shape = HalfSpace{};
  ground.mass = 0;
  ground.filter = {.category = 1u << 31, .mask = ~2u};
  scene.bodies.push_back(ground);
  for (int i = 0; i < 90; ++i) {
    const auto a = static_cast<std::uint32_t>(random->below(scene.bodies.size()));
    const auto b = static_cast<std::uint32_t>(random->below(scene.bodies.size()));
    if (a != b) scene.ignored_pairs.push_back({a, b});
  }
  return scene;
}

TEST(SceneWorld, FiltersTouchTheSamePairsAsTheNativeWorld) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  std::size_t touching = 0, excluded = 0;
  for (int round = 0; round < 20; ++round) {
    Scene scene = filtered_heap(&random);
    for (BodyDef& body : scene.bodies) body.acceleration = {};  // both test the initial poses
    scene.bodies.pop_back();  // Bullet's contacts with planes are rounded differently
    std::erase_if(scene.ignored_pairs, [&](const BodyPair& pair) {
      return std::max(pair.a, pair.b) >= scene.bodies.size();
    });
    World native(scene);
    native.step();
    Pairs expected;
    for (const Contact& c : native.contacts()) {
      if (!(c.distance < 0)) continue;  // the bodies met during the step
      expected.insert(std::minmax(c.a.index, c.b.index));
    }
    for (const DispatcherKind kind : {DispatcherKind::stock, DispatcherKind::jfpx}) {
      SceneWorld world(scene, {.dispatcher = kind, .dispatch = {.minimum_batch = 0}});
      world.step();
      ASSERT_EQ(touching_pairs(world), expected) << round;
    }
    touching += expected.size();
    Scene plain = scene;
    plain.ignored_pairs.clear();
    for (BodyDef& body : plain.bodies) body.filter = {};
    SceneWorld all(plain);
    all.step();
    excluded += touching_pairs(all).size() - expected.size();
  }
  EXPECT_GT(touching, 100u);
  EXPECT_GT(excluded, 100u);
}

TEST(SceneWorld, SensorsHaveContactPointsWithoutResponse) {
  Scene scene;
  scene.bodies = {ball({0, 2, 0}), ball({0, 0, 0})};
  scene.bodies[1].mass = 0;
  scene.bodies[1].sensor = true;
  Scene alone = scene;
  alone.bodies.pop_back();
  SceneWorld world(scene), free(alone);
  std::size_t touched = 0;
  for (int n = 0; n < 90; ++n) {
    world.step();
    free.step();
    touched += touching_pairs(world).size();
    ASSERT_EQ(world.states()[0], free.states()[0]) << n;
  }
  EXPECT_GT(touched, 5u);
}

TEST(SceneWorld, LocksAreTheFactorsOfBulletAndMoveAsStock) {
  Scene scene;
  for (int i = 0; i < 12; ++i) {
    BodyDef def = ball({Real(0.3) * static_cast<Real>(i % 3), static_cast<Real>(i) + 1, 0});
    if (i % 2 == 0) def.shape = Box{{Real(0.5), Real(0.4), Real(0.3)}};
    def.motion_locks = i % 3 == 0 ? kFixedRotation : kPlanarMotion;
    def.velocity = {0, 0, 1};
    def.angular_velocity = {1, 2, 3};
    scene.bodies.push_back(def);
  }
  BodyDef ground;
  ground.shape = HalfSpace{};
  ground.mass = 0;
  scene.bodies.push_back(ground);
  SceneWorld stock(scene, {.dispatcher = DispatcherKind::stock,
                           .solver = SolverKind::stock,
                           .world = WorldKind::stock});
  SceneWorld ours(scene, {.dispatch = {.minimum_batch = 0}});
  for (int n = 0; n < 120; ++n) {
    stock.step();
    ours.step();
    ASSERT_EQ(ours.states(), stock.states()) << n;
  }
  for (std::size_t i = 0; i < 12; ++i) {
    const BodyState state = ours.states()[i];
    const bool is_planar = scene.bodies[i].motion_locks == kPlanarMotion;
    EXPECT_EQ(state.angular_velocity.x, 0);
    EXPECT_EQ(state.angular_velocity.y, 0);
    if (is_planar) {
      EXPECT_EQ(state.position.z, 0);
    } else {
      EXPECT_EQ(state.angular_velocity.z, 0);
      EXPECT_GT(state.position.z, 0);
    }
  }
}

TEST(SceneWorld, WithFiltersMovesAsStock) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  for (int round = 0; round < 6; ++round) {
    const Scene scene = filtered_heap(&random);
    SceneWorld stock(scene, {.dispatcher = DispatcherKind::stock,
                             .solver = SolverKind::stock,
                             .world = WorldKind::stock});
    SceneWorld ours(scene, {.dispatch = {.minimum_batch = 0}});
    ContactCheck check;
    for (std::uint64_t step = 1; step <= 90; ++step) {
      check.capture(stock.world());
      stock.step();
      ours.step();
      check.compare(stock.world(), step);
      const auto difference = first_difference(stock.world(), ours.world(), step);
      ASSERT_FALSE(difference) << to_text(*difference);
      ASSERT_EQ(check.mismatches(), 0u) << to_text(*check.first());
    }
    EXPECT_GT(ours.jfpx_dispatcher()->stats().batches, 0u);
  }
}

TEST(SceneWorld, SharesShapesOnRequest) {
  Scene scene;
  scene.bodies = {ball({0, 0, 0}), ball({5, 0, 0}), ball({9, 0, 0}, 1)};
  SceneWorld shared(scene, {.share_shapes = true});
  EXPECT_EQ(shared.bodies()[0]->getCollisionShape(), shared.bodies()[1]->getCollisionShape());
  EXPECT_NE(shared.bodies()[0]->getCollisionShape(), shared.bodies()[2]->getCollisionShape());
  SceneWorld single(scene, {.share_shapes = false});
  EXPECT_NE(single.bodies()[0]->getCollisionShape(), single.bodies()[1]->getCollisionShape());
}

TEST(SceneWorld, StaticBodiesStay) {
  Scene scene;
  scene.bodies = {ball({0, 0, 0})};
  scene.bodies[0].mass = 0;
  scene.bodies[0].velocity = {1, 1, 1};
  SceneWorld world(scene);
  for (int i = 0; i < 10; ++i) world.step();
  EXPECT_EQ(world.states()[0].position, (Vec3{0, 0, 0}));
}

TEST(SceneWorld, MeasuresItsStages) {
  Scene scene;
  for (int i = 0; i < 50; ++i) scene.bodies.push_back(ball({Real(i) * Real(0.9), 0, 0}));
  SceneWorld world(scene);
  world.step();
  const StageTimes& t = world.last_step();
  const double sum = t.integrate + t.broadphase + t.dispatch + t.islands + t.solve;
  for (const double stage : {t.integrate, t.broadphase, t.dispatch, t.islands, t.solve}) {
    EXPECT_GT(stage, 0.0);
  }
  EXPECT_LE(sum, t.total);
}

TEST(SceneWorld, HashesItsStates) {
  Scene scene;
  scene.bodies = {ball({0, 0, 0}), ball({Real(0.5), Real(0.8), 0})};
  SceneWorld world(scene);
  const std::uint64_t before = world.state_hash();
  EXPECT_EQ(before, state_hash(world.states()));
  world.step();
  EXPECT_NE(world.state_hash(), before);
}

TEST(SceneWorld, RejectsAnInvalidStepAndAnInvalidScene) {
  SceneWorld world{Scene{}};
  for (const Real dt : {Real(0), Real(-1), kEpsilon, std::numeric_limits<Real>::quiet_NaN(),
                        std::numeric_limits<Real>::infinity()}) {
    EXPECT_THROW(world.step(dt), InvalidArgument) << dt;
  }
  Scene scene;
  scene.bodies = {ball({0, 0, 0}, -1)};
  EXPECT_THROW(SceneWorld{scene}, InvalidScene);
}

TEST(SceneWorld, CanBeMovedAndHasTheRequestedDispatcher) {
  Scene scene;
  scene.bodies = {ball({0, 0, 0})};
  SceneWorld first(scene, {.dispatcher = DispatcherKind::stock});
  EXPECT_EQ(first.jfpx_dispatcher(), nullptr);
  SceneWorld second = std::move(first);
  second.step();
  EXPECT_EQ(second.states().size(), 1u);
  SceneWorld ours(scene);
  EXPECT_EQ(ours.jfpx_dispatcher(), &ours.dispatcher());
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
