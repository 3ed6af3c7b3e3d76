/// Nothing passes a fixed body within a step.
#include "tests/world/chambers.hpp"
#include "tests/world/meshes.hpp"

#include <gtest/gtest.h>

#include <string>

namespace jfpx {
namespace {

using test::operator""_r;

bool is_outside(const Vec3& p, Real most) {
  return absolute(p.x) > most || absolute(p.y) > most || absolute(p.z) > most;
}

/// A ball at x = -0.2025 is hit by one of 5 m/s, towards a wall at x >= 0.
Scene hit_ball(Shape wall, const Vec3& position = {}) {
  Scene scene;
  scene.sleep.enabled = false;
  BodyDef fixed;
  fixed.shape = std::move(wall);
  fixed.mass = 0;
  fixed.position = position;
  fixed.friction = 0;
  fixed.restitution = 1;
  scene.bodies.push_back(fixed);
  for (const Real x : {-0.04725_r, -0.02025_r}) {
    BodyDef ball = test::ball({x, 0, 0}, 0.0135_r);
    ball.restitution = 1;
    scene.bodies.push_back(ball);
  }
  scene.bodies[1].velocity = {5, 0, 0};
  return scene;
}
Real x_after(World* world, int steps) {
  for (int n = 0; n < steps; ++n) world->step();
  return world->states()[2].position.x;
}

// The two scenes of a report: the second ball has no contact with the wall, because it is at rest
// at the start of the step.
TEST(ContinuousCollision, ABallThatIsHitBesideAPlaneDoesNotPass) {
  World world(hit_ball(Plane{{-1, 0, 0}, 0}));
  EXPECT_LT(x_after(&world, 30), 0);
  EXPECT_NEAR(length(world.states()[1].velocity) + length(world.states()[2].velocity), 5, 0.01_r);
}
TEST(ContinuousCollision, ABallThatIsHitBesideAThinBoxDoesNotPass) {
  World world(hit_ball(Box{{0.005_r, 2, 2}}, {0.005_r, 0, 0}));
  EXPECT_LT(x_after(&world, 30), 0);
}

/// A square in the plane x = 0.
TriangleMesh wall_mesh(bool front_is_left, bool two_sided) {
  std::vector<Triangle> triangles{{0, 1, 2}, {0, 2, 3}};
  if (front_is_left) triangles = {{0, 2, 1}, {0, 3, 2}};
  return TriangleMesh({{0, -1, -1}, {0, 1, -1}, {0, 1, 1}, {0, -1, 1}}, triangles, two_sided);
}

TEST(ContinuousCollision, AOneSidedMeshStopsBodiesFromItsFrontOnly) {
  World front(hit_ball(wall_mesh(true, false)));
  EXPECT_LT(x_after(&front, 30), 0);
  World back(hit_ball(wall_mesh(false, false)));
  EXPECT_GT(x_after(&back, 30), 1);
  World both(hit_ball(wall_mesh(false, true)));
  EXPECT_LT(x_after(&both, 30), 0);
}

TEST(ContinuousCollision, IgnoresSensorsAndPairsThatDoNotCollide) {
  const Scene scene = hit_ball(Box{{0.005_r, 2, 2}}, {0.005_r, 0, 0});
  Scene sensor = scene, moving_sensor = scene, filtered = scene, ignored = scene;
  sensor.bodies[0].sensor = true;
  filtered.bodies[0].filter = {.category = 2, .mask = 2};
  filtered.bodies[1].filter = filtered.bodies[2].filter = {.category = 1, .mask = 1};
  ignored.ignored_pairs.push_back({0, 2});
  for (const Scene& open : {sensor, filtered, ignored}) {
    World world(open);
    EXPECT_GT(x_after(&world, 30), 1);
  }
  Scene joined = scene;
  DistanceJoint spring{.a = BodyId{2, 0}, .b = BodyId{0, 0}};
  spring.max_length = 1e6_r;
  spring.collide_connected = false;
  joined.joints.push_back(spring);
  World apart(joined);
  EXPECT_GT(x_after(&apart, 30), 1);
  std::get<DistanceJoint>(joined.joints[0]).collide_connected = true;
  World connected(joined);
  EXPECT_LT(x_after(&connected, 30), 0);
}

// The arms of its contacts are constant in a step, so that its corners seem to move away.
TEST(ContinuousCollision, ASpinningBoxDoesNotPassAWall) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int k = 0; k < 100; ++k) {
    Scene scene;
    scene.bodies.push_back(test::half_space({0, 1, 0}, -9));
    scene.bodies.push_back(test::ball({0.005_r, 0, 0}));
    scene.bodies[1].shape = Box{{0.005_r, 30, 30}};
    scene.bodies[1].mass = 0;
    BodyDef box = test::ball({-1, random.uniform(-1, 1), random.uniform(-1, 1)});
    box.shape = Box{random.uniform_in_box({0.01_r, 0.01_r, 0.01_r}, {0.1_r, 0.1_r, 0.1_r})};
    box.orientation = test::random_rotation(&random);
    box.velocity = {random.uniform(20, 200), 0, 0};
    const Real spin = k % 2 == 0 ? random.uniform(0, 300) : random.uniform(300, 600);
    box.angular_velocity = test::random_direction(&random) * spin;
    scene.bodies.push_back(box);
    World world(scene);
    for (int n = 0; n < 20; ++n) world.step();
    EXPECT_LT(world.states()[2].position.x, 0);
  }
}

// A kinematic wall follows the balls.
TEST(ContinuousCollision, AKinematicWallInMotionStopsABall) {
  Scene scene = hit_ball(Box{{0.005_r, 2, 2}}, {0.025_r, 0, 0});
  scene.bodies[0].kinematic = true;
  scene.bodies[0].velocity = {-1, 0, 0};
  World world(scene);
  for (int n = 0; n < 30; ++n) {
    world.step();
    EXPECT_LT(world.states()[2].position.x, world.states()[0].position.x);
  }
}

// A hundred balls in a cube of planes, as in a report: 14 left it in 10 s.
TEST(ContinuousCollision, AGasStaysInABoxOfPlanes) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  Scene scene;
  scene.sleep.enabled = false;
  scene.soft_step.restitution_threshold = 0;
  BodyDef wall;
  wall.mass = 0;
  wall.friction = 0;
  wall.restitution = 1;
  test::add_room(&random, 1, wall, &scene);
  for (int i = 0; i < 100; ++i) {
    const auto cell = [](int k) { return 0.19_r * static_cast<Real>(k) - 0.38_r; };
    BodyDef ball = test::ball({cell(i % 5), cell(i / 5 % 5), cell(i / 25)}, 0.0135_r, 0.1_r);
    ball.velocity = random.uniform_in_box({-5, -5, -5}, {5, 5, 5});
    ball.restitution = 1;
    scene.bodies.push_back(ball);
  }
  World world(scene);
  const auto energy = [&world] {
    double sum = 0;
    for (const BodyState& state : world.states()) sum += length_squared(state.velocity);
    return sum;
  };
  const double before = energy();
  for (int n = 0; n < 600; ++n) world.step();
  for (const BodyState& state : world.states())
    EXPECT_FALSE(is_outside(state.position, test::kRoom));
  EXPECT_LE(energy(), before * 1.001);
}

// The ball is set back by 3 m of free fall, which are 30 J.
TEST(ContinuousCollision, ABallThatIsSetBackUpwardsGainsNoEnergy) {
  Scene scene = hit_ball(test::half_space({0, 1, 0}, -0.1_r).shape);
  scene.bodies[1].position = {0, 0.1_r, 0};
  scene.bodies[1].velocity = {0, -200, 0};
  scene.bodies[2].position = {0, 0, 0};
  for (BodyDef& body : scene.bodies) body.acceleration = {0, -9.81_r, 0};
  World world(scene);
  const auto energy = [&world] {
    double sum = 0;
    for (const BodyState& state : world.states()) {  // the half-space has no velocity
      sum += 0.5 * static_cast<double>(length_squared(state.velocity)) +
             test::kG * static_cast<double>(state.position.y);
    }
    return sum;
  };
  const double before = energy();
  for (int n = 0; n < 10; ++n) {
    world.step();
    EXPECT_LE(energy(), before + 1) << n;
    for (const BodyState& state : world.states()) EXPECT_GT(state.position.y, -0.1_r);
  }
}

// JFPX_TEST_SEED repeats a scene. In later steps, a body that is wedged in a corner of thin walls
// may be pushed out on the other side (docs/world.md).
TEST(ContinuousCollision, NoThrownBodyLeavesARoom) {
  for (int room = 0; room < test::kRoomCount; ++room) {
    for (int thrown = 0; thrown < test::kThrownCount; ++thrown) {
      SCOPED_TRACE(std::string(test::kThrown[thrown]) + " in " + test::kRooms[room]);
      for (int k = 0; k < 4; ++k) {
        const std::uint64_t seed = test::fresh_seed();
        SCOPED_TRACE(test::trace(seed));
        Random random(seed);
        const test::ThrowScene thrown_bodies = test::throw_scene(&random, room, thrown);
        World world(thrown_bodies.scene);
        for (int n = 0; n < 4; ++n) world.step();
        for (std::size_t i = thrown_bodies.first_thrown; i < world.states().size(); ++i) {
          EXPECT_FALSE(is_outside(world.states()[i].position, test::inside_of(room)));
        }
      }
    }
  }
}

TEST(ContinuousCollision, DoesNotDependOnTheNumberOfThreads) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int room = 0; room < test::kRoomCount; ++room) {
    const Scene scene = test::throw_scene(&random, room).scene;
    World one(scene), four(scene, {.threads = 4});
    for (int n = 0; n < 8; ++n) {
      one.step();
      four.step();
      ASSERT_EQ(one.state_hash(), four.state_hash()) << test::kRooms[room] << ", step " << n;
    }
  }
}

}  // namespace
}  // namespace jfpx
