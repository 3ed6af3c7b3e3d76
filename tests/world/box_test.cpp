/// Tests of worlds with movable boxes: falling, standing, sliding, spinning, colliding.
#include <jfpx/collide.hpp>

#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace jfpx {
namespace {

using test::operator""_r;
using test::kG;
using test::kPiD;
using test::on_the_ground;

JFPX_SOLVER_SUITE(Boxes);
JFPX_SOLVER_SUITE(FreeSpin);

BodyDef box_at(const Vec3& position, const Vec3& half_extents, Real mass = 1) {
  BodyDef def;
  def.shape = Box{half_extents};
  def.mass = mass;
  def.position = position;
  def.can_sleep = false;
  return def;
}
BodyDef cube_at(const Vec3& position) { return box_at(position, {0.5_r, 0.5_r, 0.5_r}); }
BodyDef floating(BodyDef def) {
  def.acceleration = {};
  return def;
}

/// Kinetic energy and momenta of boxes and balls, in double.
test::Sums box_sums(const World& world) {
  test::Sums total;
  const auto states = world.states();
  const std::vector<BodyDef> bodies = test::definitions(world);
  for (std::size_t i = 0; i < states.size(); ++i) {
    const BodyDef& def = bodies[i];
    if (!(def.mass > 0)) continue;
    const BodyState& s = states[i];
    const auto* box = std::get_if<Box>(&def.shape);
    const Vec3 moments = box != nullptr
                             ? detail::moments_of_inertia(*box, def.mass)
                             : detail::moments_of_inertia(std::get<Sphere>(def.shape), def.mass);
    const Mat3 inertia = detail::in_world_axes(diagonal(moments), to_matrix(s.orientation));
    const Vec3 spin = inertia * s.angular_velocity;
    const Vec3 orbit = cross(s.position, s.velocity) * def.mass;
    total.energy += static_cast<double>(
        (length_squared(s.velocity) * def.mass + dot(s.angular_velocity, spin)) / 2);
    total.scale +=
        static_cast<double>((length(s.velocity) + length(orbit)) * def.mass + length(spin));
    for (int k = 0; k < 3; ++k) {
      total.momentum[k] += static_cast<double>(s.velocity[k] * def.mass);
      total.angular_momentum[k] += static_cast<double>(orbit[k] + spin[k]);
    }
  }
  return total;
}

TEST_P(Boxes, FallenOnACornerComeToRestOnAFace) {
  BodyDef def = cube_at({0, 4, 0});
  def.orientation = normalized(Quat{0.88_r, 0.325_r, 0.05_r, -0.3_r});
  World world(on_the_ground({def}));
  for (int n = 0; n < 600; ++n) world.step();
  const BodyState s = world.states()[0];
  EXPECT_NEAR(s.position.y, 0.5, 0.0101);
  EXPECT_LT(length(s.velocity), 1e-3_r);
  EXPECT_LT(length(s.angular_velocity), 1e-3_r);
  EXPECT_EQ(world.contacts().size(), 4u);
  const Mat3 axes = to_matrix(s.orientation);
  Real upright = 0;
  for (int i = 0; i < 3; ++i) upright = std::max(upright, absolute(axes(1, i)));
  EXPECT_NEAR(upright, 1, 1e-4);
}

TEST_P(Boxes, AStackOfTenMovesLessThanAMillimetreInTenSeconds) {
  test::expect_that_ten_stand(cube_at({0, 0.5_r, 0}), 1);
}

TEST_P(Boxes, AStackOfFiveStandsAndFallsAsleepWithTheUsualSettings) {
  std::vector<BodyDef> boxes;
  for (int i = 0; i < 5; ++i) {
    boxes.push_back(cube_at({0, 0.5_r + static_cast<Real>(i), 0}));
    boxes.back().can_sleep = true;
  }
  World world(on_the_ground(boxes));
  StepReport report;
  for (int n = 0; n < 600; ++n) report = world.step();
  EXPECT_EQ(report.awake, 0u);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_NEAR(world.states()[i].position.y, 0.5 + static_cast<double>(i), 0.06);
    EXPECT_NEAR(world.states()[i].position.x, 0, GetParam() == Solver::soft_step ? 0.01 : 1e-3);
  }
}

TEST_P(Boxes, SlideToAStopAfterVSquaredOverTwoMuG) {
  BodyDef def = cube_at({0, 0.5_r, 0});
  def.velocity = {3, 0, 0};
  Scene scene = on_the_ground({def});
  scene.dt = 0.001_r;
  World world(scene);
  for (int n = 0; n < 1500; ++n) world.step();
  EXPECT_NEAR(world.states()[0].position.x, 9 / (2 * 0.5 * kG), 0.01);
  EXPECT_NEAR(world.states()[0].position.z, 0, 1e-3);
  EXPECT_NEAR(world.states()[0].velocity.x, 0, 1e-3);
}

/// A flat box on a slope whose tangent is `steepness` times the friction, 0.5.
World on_a_slope(double steepness, bool can_sleep) {
  const double angle = std::atan(0.5 * steepness);
  const Vec3 up{static_cast<Real>(std::sin(angle)), static_cast<Real>(std::cos(angle)), 0};
  BodyDef def = box_at(up * 0.25_r, {0.5_r, 0.25_r, 0.5_r});
  def.orientation = {static_cast<Real>(std::cos(angle / 2)), 0, 0,
                     static_cast<Real>(-std::sin(angle / 2))};
  def.can_sleep = can_sleep;
  Scene scene = test::empty_scene();
  scene.bodies = {def, test::half_space(up, 0)};
  return World(scene);
}

TEST_P(Boxes, SlideDownASlopeAboveTheAngleOfFriction) {
  for (const double steepness : {1.05, 1.3, 2.0}) {
    World world = on_a_slope(steepness, false);
    const auto speed = [&world] { return static_cast<double>(length(world.states()[0].velocity)); };
    for (int n = 0; n < 60; ++n) world.step();
    const double before = speed();
    for (int n = 0; n < 60; ++n) world.step();
    const double angle = std::atan(0.5 * steepness);
    const double pull = kG * (std::sin(angle) - 0.5 * std::cos(angle));
    EXPECT_NEAR(speed() - before, pull, 0.03 * pull) << steepness;
    EXPECT_GT(world.states()[0].velocity.x, 0);
  }
}

TEST_P(Boxes, StayOnASlopeBelowTheAngleOfFriction) {
  for (const double steepness : {0.5, 0.8, 0.95}) {
    World world = on_a_slope(steepness, true);
    const Vec3 start = world.states()[0].position;
    for (int n = 0; n < 60; ++n) world.step();
    const auto resting = world.states();
    EXPECT_FALSE(world.awake(world.bodies()[0]));
    EXPECT_LT(length(resting[0].position - start), 0.025_r) << steepness;
    for (int n = 0; n < 600; ++n) world.step();
    EXPECT_EQ(world.states(), resting);

    // An awake box creeps: the loops correct corners that approach, and let the others separate.
    World awake = on_a_slope(steepness, false);
    for (int n = 0; n < 60; ++n) awake.step();
    const Vec3 then = awake.states()[0].position;
    for (int n = 0; n < 60; ++n) awake.step();
    EXPECT_LT(length(awake.states()[0].position - then), 0.02_r) << steepness;
  }
}

TEST_P(Boxes, SpinningOnTheGroundAreStoppedByFriction) {
  BodyDef def = cube_at({0, 0.5_r, 0});
  def.angular_velocity = {0, 5, 0};
  Scene scene = on_the_ground({def});
  scene.dt = 0.001_r;
  World world(scene);
  // The corners are sqrt(1/2) from the centre: mu m g sqrt(1/2) against I = m/6.
  const double slowing = 0.5 * kG * std::sqrt(0.5) * 6;
  for (int n = 0; n < 120; ++n) world.step();
  EXPECT_NEAR(world.states()[0].angular_velocity.y, 5 - slowing * 0.12, 0.1);
  for (int n = 0; n < 200; ++n) world.step();
  EXPECT_NEAR(world.states()[0].angular_velocity.y, 0, 1e-3);
}

TEST_P(Boxes, ABallRestsOnABoxThatRestsOnTheGround) {
  BodyDef ball = test::ball({0, 1.5_r, 0}, 0.5_r);
  ball.acceleration = {0, -9.81_r, 0};
  World world(on_the_ground({ball, cube_at({0, 0.5_r, 0})}));
  StepReport report;
  for (int n = 0; n < 300; ++n) report = world.step();
  EXPECT_EQ(report.contacts, 5u);
  EXPECT_EQ(report.sphere_contacts, 0u);
  EXPECT_NEAR(world.states()[0].position.y, 1.5, 0.021);
  EXPECT_NEAR(world.states()[0].position.x, 0, 1e-3);
  EXPECT_NEAR(world.states()[1].position.y, 0.5, 0.0101);
}

TEST(Erratum, E23_a_box_has_the_inertia_of_a_solid_box) {
  World world([] {
    Scene scene;
    scene.bodies = {floating(box_at({0, 0, 0}, {1, 2, 3}, 6))};
    scene.dt = 0.001_r;
    return scene;
  }());
  // m/3 (b^2 + c^2): 26, 20, 10 about x, y, z.
  world.apply_torque(world.bodies()[0], {26, 20, 10});
  world.step();
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(world.states()[0].angular_velocity[i], 1e-3, 1e-8);
}

TEST_P(FreeSpin, ASymmetricTopPrecessesAboutItsAngularMomentum) {
  // Moments about x and y are 2.5 times the one about z. The axis precesses with L / I_x; in these
  // units that is the length of (0.5, 0, 3 / 2.5) = 1.3 rad/s.
  BodyDef def = floating(box_at({0, 0, 0}, {0.5_r, 0.5_r, 1}));
  def.angular_velocity = {0.5_r, 0, 3};
  Scene scene = test::empty_scene();
  scene.dt = 0.0005_r;
  scene.bodies = {def};
  World world(scene);
  const test::Sums before = box_sums(world);
  const double round = 2 * kPiD / 1.3;
  const auto half_round = static_cast<int>(std::lround(round / 0.0005 / 2));
  const auto axis = [&world] { return to_matrix(world.states()[0].orientation).column(2); };
  for (int n = 0; n < half_round; ++n) world.step();
  // The opposite side of the cone: at twice the angle between axis and momentum.
  const double between = 2 * std::atan2(0.5, 1.2);
  EXPECT_NEAR(std::acos(static_cast<double>(axis().z)), between, 0.01);
  for (int n = 0; n < half_round; ++n) world.step();
  EXPECT_NEAR(axis().x, 0, 0.01);
  EXPECT_NEAR(axis().y, 0, 0.01);
  const test::Sums after = box_sums(world);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(after.angular_momentum[k], before.angular_momentum[k], 0.01 * before.scale);
  }
  EXPECT_LE(after.energy, before.energy * (1 + 1e-4));
}

TEST_P(FreeSpin, AboutTheMiddleAxisTumblesWithoutGainingEnergy) {
  BodyDef def = floating(box_at({0, 0, 0}, {1, 0.6_r, 0.3_r}));
  def.angular_velocity = {0.01_r, 4, 0.01_r};
  Scene scene = test::empty_scene();
  scene.dt = 0.001_r;
  scene.bodies = {def};
  World world(scene);
  const double energy = box_sums(world).energy;
  Real lowest = 1;
  for (int n = 0; n < 10000; ++n) {
    world.step();
    lowest = std::min(lowest, to_matrix(world.states()[0].orientation)(1, 1));
    ASSERT_LE(box_sums(world).energy, energy * (1 + 5e-4));
  }
  EXPECT_LT(lowest, -0.9_r);  // the box was upside down in between
  EXPECT_GT(box_sums(world).energy, 0.9 * energy);
}

TEST_P(FreeSpin, ACubeSpinsAsABallDoes) {
  BodyDef cube = floating(cube_at({0, 0, 0}));
  cube.angular_velocity = {1, 2, 3};
  Scene scene = test::empty_scene();
  scene.bodies = {cube};
  World world(scene);
  for (int n = 0; n < 600; ++n) world.step();
  EXPECT_EQ(world.states()[0].angular_velocity, (Vec3{1, 2, 3}));
}

/// Boxes and balls in a heap, all moving towards the centre.
Scene cloud(Random* random, int count) {
  Scene scene = test::empty_scene();
  for (int i = 0; i < count; ++i) {
    const Vec3 place = random->uniform_in_box({-4, -4, -4}, {4, 4, 4});
    BodyDef def = floating(box_at(place, random->uniform_in_box({0.3_r, 0.3_r, 0.3_r}, {1, 1, 1})));
    if (i % 3 == 0) def.shape = Sphere{random->uniform(0.3_r, 1)};
    def.mass = random->uniform(1, 5);
    def.velocity = place * Real(-1);
    def.angular_velocity = random->uniform_in_box({-1, -1, -1}, {1, 1, 1});
    def.friction = random->uniform();
    def.restitution = random->uniform();
    scene.bodies.push_back(def);
  }
  return scene;
}

TEST_P(Boxes, HittingEachOtherKeepTheMomentaAndGainNoEnergy) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  // Either friction or restitution, not both: Newton's restitution of the normal velocity can gain
  // energy with friction, when a normal impulse makes a corner slide (Kane and Levinson 1985).
  for (const bool rough : {true, false}) {
    Random random(seed);
    Scene scene = cloud(&random, 40);
    for (BodyDef& def : scene.bodies) (rough ? def.restitution : def.friction) = 0;
    scene.resolver.position_epsilon = 100;  // projections rotate boxes without momentum
    scene.soft_step.push_out_speed = 1e-6_r;
    scene.dt = 0.001_r;
    World world(scene);
    const test::Sums before = box_sums(world);
    std::uint64_t contacts = 0;
    double energy = before.energy;
    for (int n = 0; n < 1000; ++n) {
      contacts += world.step().contacts;
      const double now = box_sums(world).energy;
      if (GetParam() == Solver::worst_first) {
        ASSERT_LE(now, energy * (1 + 1e-5)) << n << (rough ? " rough" : " bouncing");
      }
      energy = now;
    }
    EXPECT_GT(contacts, 50u);
    const test::Sums after = box_sums(world);
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(after.momentum[k], before.momentum[k], 1e-5 * before.scale);
      EXPECT_NEAR(after.angular_momentum[k], before.angular_momentum[k], 2e-3 * before.scale);
    }
  }
}

TEST_P(Boxes, AllTouchingPairsAreFoundInOrder) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  Scene scene = cloud(&random, 60);
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    BodyDef& def = scene.bodies[i];
    def.velocity = def.angular_velocity = {};
    if (i % 7 == 0) def.mass = 0;
  }
  scene.bodies.insert(scene.bodies.begin() + 20, test::half_space({0, 1, 0}, -2));
  World world(scene);
  world.step();

  std::vector<Contact> expected;
  const auto pose = [&](std::uint32_t i) {
    return make_transform(scene.bodies[i].orientation, scene.bodies[i].position);
  };
  const auto sphere = [&](std::uint32_t i) { return std::get_if<Sphere>(&scene.bodies[i].shape); };
  const auto box = [&](std::uint32_t i) { return std::get_if<Box>(&scene.bodies[i].shape); };
  const auto id = [&](std::uint32_t i) { return world.bodies()[i]; };
  const auto touch = [&](std::uint32_t a, std::uint32_t b, const Touch& t) {
    if (t.touching) expected.push_back({id(a), id(b), t.normal, t.point, t.distance});
  };
  const auto touches = [&](std::uint32_t a, std::uint32_t b, const Manifold& m) {
    for (int k = 0; k < m.count; ++k) {
      expected.push_back({id(a), id(b), m.normal, m.points[k].point, m.points[k].distance});
    }
  };
  const auto count = static_cast<std::uint32_t>(scene.bodies.size());
  for (std::uint32_t a = 0; a < count; ++a) {
    for (std::uint32_t b = 0; b < count; ++b) {
      const bool a_moves = scene.bodies[a].mass > 0, b_moves = scene.bodies[b].mass > 0;
      if (a == b || (!a_moves && !b_moves)) continue;
      const auto* ground = std::get_if<HalfSpace>(&scene.bodies[b].shape);
      if (sphere(a) != nullptr) {
        const SphereInstance s{scene.bodies[a].position, sphere(a)->radius};
        if (ground != nullptr) touch(a, b, collide(s, *ground));
        if (box(b) != nullptr) touch(a, b, collide(s, *box(b), pose(b)));
      } else if (box(a) != nullptr) {
        if (ground != nullptr) touches(a, b, collide(*box(a), pose(a), *ground));
        // Of two movable boxes the lower index comes first, else the movable one.
        const bool first = a_moves && (!b_moves || a < b);
        if (box(b) != nullptr && first) touches(a, b, collide(*box(a), pose(a), *box(b), pose(b)));
      }
    }
  }
  std::vector<Contact> found(world.contacts().begin(), world.contacts().end());
  std::erase_if(found, [&](const Contact& c) { return sphere(c.a.index) && sphere(c.b.index); });
  std::erase_if(found, [](const Contact& c) { return c.distance == 0; });  // met during the step
  for (Contact& c : found) c.friction = c.restitution = 0;  // the pair tests do not set them
  EXPECT_GT(found.size(), 50u);
  EXPECT_EQ(found, expected);
}

TEST_P(Boxes, RunTheSameWithAnyNumberOfThreads) {
  Random random(7);
  Scene scene = cloud(&random, 60);
  for (BodyDef& def : scene.bodies) def.acceleration = {0, -9.81_r, 0};
  scene.bodies.push_back(test::half_space({0, 1, 0}, -6));
  std::uint64_t expected = 0;
  for (const unsigned threads : {1u, 2u, 8u}) {
    WorldSettings settings;
    settings.threads = threads;
    World world(scene, settings);
    for (int n = 0; n < 120; ++n) world.step();
    if (threads == 1) expected = world.state_hash();
    EXPECT_EQ(world.state_hash(), expected) << threads;
  }
}

TEST_P(Boxes, ALongRunOfBoxesAndBallsStaysFiniteAndAboveTheGround) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  Scene scene = cloud(&random, 16);
  for (BodyDef& def : scene.bodies) {
    def.acceleration = {0, -9.81_r, 0};
    def.position.y += 5;
    def.can_sleep = true;
  }
  scene.bodies.push_back(test::ground());
  World world(scene);
  for (int n = 0; n < 10000; ++n) {
    ASSERT_FALSE(world.step().non_finite) << n;
    for (std::size_t i = 0; i < 16; ++i) ASSERT_GT(world.states()[i].position.y, 0) << n;
  }
}

}  // namespace
}  // namespace jfpx
