/// Tests of compounds and planes: mass, contacts, motion.
#include "src/scene/compound.hpp"

#include <jfpx/error.hpp>

#include "src/collide/shapes.hpp"
#include "src/scene/inertia.hpp"
#include "src/scene/principal_inertia.hpp"
#include "src/thesis/contact_search.hpp"
#include "src/world/thesis_table.hpp"
#include "tests/collide/contact_oracle.hpp"
#include "tests/world/random_bodies.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

namespace jfpx {
namespace {

using test::operator""_r;
using test::kEps;

CompoundPart sphere_part(const Vec3& position, Real radius) {
  return {.shape = Sphere{radius}, .position = position};
}
CompoundPart box_part(const Vec3& position, const Vec3& half_extents, const Quat& rotation = {}) {
  return {.shape = Box{half_extents}, .position = position, .orientation = rotation};
}
BodyDef body_of(Compound compound, const Vec3& position, Real mass = 1) {
  BodyDef def;
  def.shape = std::move(compound);
  def.mass = mass;
  def.position = position;
  def.can_sleep = false;
  return def;
}
/// Two balls of radius 1/2 whose centres are 2 apart, along z.
Compound dumbbell() { return {{sphere_part({0, 0, -1}, 0.5_r), sphere_part({0, 0, 1}, 0.5_r)}}; }
/// An L of two adjacent bars: 3 x 1 and 1 x 2.
Compound angle_iron() {
  return centred(
      {{box_part({0, 0, 0}, {1.5_r, 0.5_r, 0.5_r}), box_part({-1, 1.5_r, 0}, {0.5_r, 1, 0.5_r})}});
}

std::vector<Contact> find_contacts(const BodyStore& bodies, std::uint64_t* sphere_contacts) {
  ContactFinder contact_finder(make_broad_phase(make_sphere_collider(), BroadPhase::cells),
                               SimdLevel::automatic);
  contact_finder.set_bodies(bodies);
  std::vector<Contact> contacts;
  *sphere_contacts = thesis::ContactSearch().find_contacts(bodies, &contact_finder, &contacts);
  return contacts;
}

TEST(Compound, ADumbbellHasTheInertiaOfItsBallsAndTheirDistance) {
  const MassProperties m = mass_properties(dumbbell(), 3);
  EXPECT_EQ(m.centre, Vec3{});
  // 0.4 m r^2 = 0.3 in all, and 3 kg at 1 m from x and y.
  EXPECT_NEAR(m.inertia(0, 0), 3.3, 8 * kEps);
  EXPECT_NEAR(m.inertia(1, 1), 3.3, 8 * kEps);
  EXPECT_NEAR(m.inertia(2, 2), 0.3, 8 * kEps);
  EXPECT_EQ(m.inertia(0, 1), 0);
}

TEST(Compound, PartsWeighTheirDensityTimesVolume) {
  // A box of 1 m^3 and one of 3 m^3 that is twice as dense: 1 to 6.
  Compound compound{
      {box_part({7, 0, 0}, {0.5_r, 0.5_r, 0.5_r}), box_part({0, 7, 0}, {1.5_r, 0.5_r, 0.5_r})}};
  compound.parts[1].density = 2;
  const Vec3 centre = mass_properties(compound, 1).centre;
  EXPECT_NEAR(centre.x, 1, 8 * kEps);
  EXPECT_NEAR(centre.y, 6, 8 * kEps);
  const Compound moved = centred(compound);
  EXPECT_NEAR(length(mass_properties(moved, 1).centre), 0, 8 * kEps);
  EXPECT_NEAR(length(moved.parts[0].position - compound.parts[0].position - Vec3{-1, -6, 0}), 0,
              16 * kEps);
}

TEST(Compound, ABoxCutInAnyDirectionKeepsItsInertia) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int n = 0; n < 1000; ++n) {
    const Vec3 h = random.uniform_in_box({0.1_r, 0.1_r, 0.1_r}, {2, 2, 2});
    const Quat rotation = test::random_rotation(&random);
    const Real cut = random.uniform(-0.9_r, 0.9_r) * h.x;  // the plane x = cut divides the box
    const Vec3 low{(h.x + cut) / 2, h.y, h.z}, high{(h.x - cut) / 2, h.y, h.z};
    const Compound halves{{box_part(rotate(rotation, {(cut - h.x) / 2, 0, 0}), low, rotation),
                           box_part(rotate(rotation, {(cut + h.x) / 2, 0, 0}), high, rotation)}};
    const MassProperties found = mass_properties(halves, 2);
    const Mat3 expected =
        detail::in_world_axes(diagonal(detail::moments_of_inertia(Box{h}, 2)), to_matrix(rotation));
    ASSERT_LE(length(found.centre), 16 * kEpsilon);
    const PrincipalInertia principal = principal_inertia(found.inertia);
    const Mat3 again = detail::in_world_axes(diagonal(principal.moments), principal.axes);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        ASSERT_NEAR(found.inertia(i, j), expected(i, j), 200 * kEps);
        ASSERT_NEAR(again(i, j), expected(i, j), 200 * kEps);
      }
    }
    ASSERT_NEAR(determinant(principal.axes), 1, 16 * kEps);
  }
}

TEST(PrincipalInertia, OfADiagonalTensorLeavesTheAxes) {
  const Mat3 tensor = diagonal({3, 1, 2});
  EXPECT_EQ(principal_inertia(tensor).axes, Mat3{});
  EXPECT_EQ(principal_inertia(tensor).moments, (Vec3{3, 1, 2}));
  Mat3 noisy = tensor;
  noisy(0, 1) = noisy(1, 0) = 4 * kEpsilon;
  EXPECT_EQ(principal_inertia(noisy).axes, Mat3{});
}

TEST(Compound, SpinsFreelyAsTheBoxThatItsPartsMakeUp) {
  for (const Solver solver : test::kSolvers) {
    SCOPED_TRACE(to_string(solver));
    // Body axes rotated relative to the box, so that all six entries of the tensor are nonzero.
    const Quat inside = normalized(Quat{1, 0.3_r, -0.4_r, 0.7_r});
    const Vec3 h{0.3_r, 0.6_r, 1};
    BodyDef whole = test::ball({});
    whole.shape = Box{h};
    whole.orientation = normalized(Quat{1, 1, 0.2_r, 0});
    whole.angular_velocity = {0.1_r, 3, 0.2_r};  // about the middle axis: tumbles
    BodyDef halves = whole;
    halves.position = {10, 0, 0};
    halves.orientation = whole.orientation * conjugate(inside);
    halves.shape = Compound{{box_part(rotate(inside, {-0.15_r, 0, 0}), {0.15_r, 0.6_r, 1}, inside),
                             box_part(rotate(inside, {0.15_r, 0, 0}), {0.15_r, 0.6_r, 1}, inside)}};
    Scene scene;
    scene.solver = solver;
    scene.bodies = {whole, halves};
    World world(scene);
    for (int n = 0; n < 120; ++n) world.step();
    const auto states = world.states();
    EXPECT_NEAR(length(states[0].angular_velocity - states[1].angular_velocity), 0, 1e4 * kEps);
    const Mat3 axes = to_matrix(states[0].orientation);
    const Mat3 others = to_matrix(states[1].orientation * inside);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(length(axes.column(i) - others.column(i)), 0, 1e4 * kEps);
    }
    EXPECT_GT(length(states[0].angular_velocity - whole.angular_velocity), 1);
  }
}

TEST(Compound, AllContactsAreFoundInOrder) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  std::size_t spheres = 0, others = 0;
  // Some random bodies have few contacts of two spheres.
  for (int n = 0; n < 300 || (spheres <= 100 && n < 3000); ++n) {
    BodyStore bodies(0.01_r, SleepSettings{});
    for (std::uint64_t left = 2 + random.below(40); left > 0; --left) {
      bodies.add(test::random_body(&random, 2.5_r));
    }
    std::uint64_t sphere_contacts = 0;
    const auto found = find_contacts(bodies, &sphere_contacts);
    ASSERT_EQ(found, test::ContactOracle(bodies).contacts()) << n;
    spheres += sphere_contacts;
    others += found.size() - sphere_contacts;
  }
  EXPECT_GT(spheres, 100u);
  EXPECT_GT(others, 1000u);
}

TEST(Compound, PartsOfOneBodyNeverTouchEachOther) {
  Compound heap;
  for (int i = 0; i < 4; ++i) heap.parts.push_back(sphere_part({}, 1));
  for (int i = 0; i < 4; ++i) heap.parts.push_back(box_part({}, {1, 1, 1}));
  Scene scene;
  scene.bodies = {body_of(heap, {})};
  World world(scene);
  EXPECT_EQ(world.step().contacts, 0u);
}

TEST(Compound, ContactsOfTwoBodiesAreConsecutive) {
  // Two dumbbells side by side: both balls touch, and one ball also touches a third body.
  Scene scene;
  scene.bodies = {body_of(dumbbell(), {0, 0, 0}), body_of(dumbbell(), {0.9_r, 0, 0}),
                  body_of({{sphere_part({}, 0.5_r)}}, {0, 0.9_r, 1})};
  for (BodyDef& def : scene.bodies) def.acceleration = {};
  World world(scene);
  EXPECT_EQ(world.step().sphere_contacts, 3u);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (const Contact& c : world.contacts()) pairs.emplace_back(c.a.index, c.b.index);
  EXPECT_EQ(pairs, (decltype(pairs){{0, 1}, {0, 1}, {0, 2}}));
}

TEST(Compound, FallsAsABallDoes) {
  for (const Solver solver : test::kSolvers) {
    SCOPED_TRACE(to_string(solver));
    Scene scene;
    scene.solver = solver;
    scene.bodies = {body_of(angle_iron(), {0, 0, 0}), test::ball({100, 0, 0})};
    scene.bodies[1].acceleration = {0, -9.81_r, 0};
    World world(scene);
    for (int n = 0; n < 60; ++n) world.step();
    EXPECT_EQ(world.states()[0].position.y, world.states()[1].position.y);
    EXPECT_EQ(world.states()[0].angular_velocity, Vec3{});
  }
}

TEST(Compound, ADumbbellThatFellOnOneEndComesToRestOnBoth) {
  for (const Solver solver : test::kSolvers) {
    SCOPED_TRACE(to_string(solver));
    BodyDef def = body_of(dumbbell(), {0, 3, 0});
    def.orientation = normalized(Quat{1, 0.4_r, 0, 0});
    def.linear_damping = def.angular_damping = 0.7_r;  // otherwise it would keep rolling
    Scene scene;
    scene.solver = solver;
    scene.bodies = {def, test::ground()};
    World world(scene);
    for (int n = 0; n < 900; ++n) world.step();
    const BodyState s = world.states()[0];
    EXPECT_NEAR(s.position.y, 0.5, 0.0101);
    EXPECT_NEAR(rotate(s.orientation, {0, 0, 1}).y, 0, 0.0101);
    EXPECT_EQ(world.contacts().size(), 2u);
    EXPECT_LT(length(s.velocity), 0.05_r);
  }
}

TEST(Compound, AnAngleIronFallsAsleepFlatOnTheGround) {
  for (const Solver solver : test::kSolvers) {
    SCOPED_TRACE(to_string(solver));
    BodyDef def = body_of(angle_iron(), {0, 4, 0});
    def.orientation = normalized(Quat{0.9_r, 0.2_r, 0.1_r, -0.3_r});
    def.can_sleep = true;
    Scene scene;
    scene.solver = solver;
    scene.bodies = {def, test::ground()};
    scene.sleep.epsilon = 0.05_r;  // at the default of 0.3 it would fall asleep while it tips over
    World world(scene);
    for (int n = 0; n < 900; ++n) world.step();
    EXPECT_FALSE(world.awake(world.bodies()[0]));
    // At least four corners touch, of one bar or of both ends of the L, none of them deep.
    EXPECT_GE(world.contacts().size(), 4u);
    for (const Contact& c : world.contacts()) EXPECT_GT(c.distance, -0.02);
  }
}

TEST(Compound, ARollingDumbbellAcceleratesByItsInertia) {
  for (const Solver solver : test::kSolvers) {
    SCOPED_TRACE(to_string(solver));
    // Two wheels on a heavy axle that does not touch the ground, down a slope whose sine is 0.2:
    // a = g sin / (1 + I / (M r^2)).
    const double wheel = 4.0 / 3.0 * 3.14159265358979323846 * 0.125, axle = 8 * 0.01 * 10;
    const double per_mass = (2 * wheel * 0.4 * 0.25 + axle * 2.0 / 3.0 * 0.01) / (2 * wheel + axle);
    const double expected = 9.81 * 0.2 / (1 + per_mass / 0.25);
    Compound compound = dumbbell();
    compound.parts.push_back(box_part({}, {0.1_r, 0.1_r, 1}));
    compound.parts.back().density = 10;
    Scene scene;
    scene.solver = solver;
    const Real sine = 0.2_r, cosine = square_root(0.96_r);
    scene.bodies = {body_of(compound, {0, 0.5_r, 0}, 7), test::ground()};
    scene.bodies[0].acceleration = {9.81_r * sine, -9.81_r * cosine, 0};
    World world(scene);
    for (int n = 0; n < 120; ++n) world.step();
    const BodyState s = world.states()[0];
    EXPECT_NEAR(s.velocity.x, 2 * expected, 0.01 * 2 * expected);
    // Rolls without sliding; up to a centimetre deep, which reduces the effective radius.
    EXPECT_NEAR(-s.angular_velocity.z * 0.5_r, s.velocity.x, 0.1);
    EXPECT_NEAR(s.position.z, 0, 1e-3);
  }
}

TEST(Compound, ThrownBodiesKeepMomentumWhenTheyMeet) {
  for (const Solver solver : test::kSolvers) {
    SCOPED_TRACE(to_string(solver));
    const std::uint64_t seed = test::fresh_seed();
    SCOPED_TRACE(test::trace(seed));
    Random random(seed);
    Scene scene;
    scene.solver = solver;
    for (int i = 0; i < 20; ++i) {
      BodyDef def = body_of(test::random_compound(&random), {}, random.uniform(1, 5));
      def.position = random.uniform_in_box({-4, -4, -4}, {4, 4, 4});
      def.velocity = -def.position;
      def.angular_velocity = random.uniform_in_box({-2, -2, -2}, {2, 2, 2});
      def.acceleration = {};
      scene.bodies.push_back(def);
    }
    World world(scene);
    const auto momentum = [&] {
      Vec3 sum;
      const auto states = world.states();
      for (std::size_t i = 0; i < states.size(); ++i) {
        sum += states[i].velocity * scene.bodies[i].mass;
      }
      return sum;
    };
    const Vec3 before = momentum();
    std::uint64_t contacts = 0;
    for (int n = 0; n < 120; ++n) contacts += world.step().contacts;
    EXPECT_GT(contacts, 20u);
    EXPECT_NEAR(length(momentum() - before), 0, 1e4 * kEps);
  }
}

TEST(Compound, RunsTheSameWithAnyNumberOfThreadsAndAlgorithm) {
  Random random(11);
  Scene scene;
  for (int i = 0; i < 60; ++i) {
    BodyDef def = test::random_body(&random, 4);
    def.position.y += 4;
    if (def.mass > 0) scene.bodies.push_back(def);
  }
  scene.bodies.push_back(test::half_space({0, 1, 0}, -1));
  for (const Solver solver : test::kSolvers) {
    SCOPED_TRACE(to_string(solver));
    scene.solver = solver;
    std::uint64_t expected = 0;
    for (const SphereAlgorithm algorithm :
         {SphereAlgorithm::automatic, SphereAlgorithm::all_pairs, SphereAlgorithm::grid}) {
      for (const unsigned threads : {1u, 2u, 8u}) {
        WorldSettings settings;
        settings.collider.algorithm = algorithm;
        settings.threads = threads;
        World world(scene, settings);
        for (int n = 0; n < 120; ++n) world.step();
        if (expected == 0) expected = world.state_hash();
        EXPECT_EQ(world.state_hash(), expected) << threads;
      }
    }
  }
}

/// Kinetic and potential energy, in double.
double energy(const World& world) {
  double sum = 0;
  const auto states = world.states();
  const std::vector<BodyDef> bodies = test::definitions(world);
  for (std::size_t i = 0; i < states.size(); ++i) {
    const BodyDef& def = bodies[i];
    if (!(def.mass > 0)) continue;
    const BodyState& s = states[i];
    const Mat3 tensor = detail::in_world_axes(
        mass_properties(std::get<Compound>(def.shape), def.mass).inertia, to_matrix(s.orientation));
    sum += static_cast<double>(def.mass * length_squared(s.velocity) / 2);
    sum += static_cast<double>(dot(s.angular_velocity, tensor * s.angular_velocity) / 2);
    sum -= static_cast<double>(def.mass * dot(def.acceleration, s.position));
  }
  return sum;
}

/// JFPX_LONG_STEPS sets another number of steps.
TEST(Compound, ALongRunStaysFiniteGainsNoEnergyAndStaysAboveTheGround) {
  for (const Solver solver : test::kSolvers) {
    SCOPED_TRACE(to_string(solver));
    const std::uint64_t seed = test::fresh_seed();
    SCOPED_TRACE(test::trace(seed));
    Random random(seed);
    Scene scene;
    scene.solver = solver;
    for (int i = 0; i < 12; ++i) {
      const Vec3 place = random.uniform_in_box({-3, 4, -3}, {3, 12, 3});
      BodyDef def = body_of(test::random_compound(&random), place, random.uniform(1, 5));
      def.orientation = test::random_rotation(&random);
      def.can_sleep = i % 2 == 0;
      scene.bodies.push_back(def);
    }
    scene.bodies.push_back(test::ground());
    World world(scene);
    // Bodies that overlap at the start are moved apart in the first steps, which can lift them.
    for (int n = 0; n < 10; ++n) world.step();
    // worst_first can lift bodies at any time: it corrects the overlap of fast ones within a step.
    const double most = energy(world) * (solver == Solver::worst_first ? 1.5 : 1.01);
    const char* more = std::getenv("JFPX_LONG_STEPS");
    const int steps = more != nullptr ? std::atoi(more) : 2000;
    for (int n = 0; n < steps; ++n) {
      ASSERT_FALSE(world.step().non_finite) << n;
      for (const BodyState& s : world.states()) ASSERT_GT(s.position.y, -0.05) << n;
      ASSERT_LE(energy(world), most) << n;
    }
  }
}

TEST(PlaneBody, HoldsBodiesOnTheSideWhereTheyAre) {
  for (const Solver solver : test::kSolvers) {
    SCOPED_TRACE(to_string(solver));
    // Gravity presses each body to the plane z = 1 from its own side.
    Scene scene;
    scene.solver = solver;
    BodyDef wall;
    wall.shape = Plane{{0, 0, 1}, 1};
    wall.mass = 0;
    scene.bodies = {wall, test::ball({0, 0, 3}, 0.5_r), test::ball({0, 0, -1}, 0.5_r),
                    body_of(dumbbell(), {4, 0, 3.5_r}), body_of(dumbbell(), {-4, 0, -1.5_r})};
    for (std::size_t i = 1; i < 5; ++i) {
      scene.bodies[i].acceleration = {0, 0, scene.bodies[i].position.z > 1 ? -9.81_r : 9.81_r};
    }
    World world(scene);
    for (int n = 0; n < 300; ++n) world.step();
    const auto states = world.states();
    EXPECT_NEAR(states[1].position.z, 1.5, 0.0101);
    EXPECT_NEAR(states[2].position.z, 0.5, 0.0101);
    EXPECT_NEAR(states[3].position.z, 2.5, 0.0101);
    EXPECT_NEAR(states[4].position.z, -0.5, 0.0101);
  }
}

TEST(PlaneBody, PushesAllPartsToTheSideOfTheCentreOfMass) {
  Scene scene;
  BodyDef wall;
  wall.shape = Plane{{0, 1, 0}, 0};
  wall.mass = 0;
  // Upright with the centre 0.1 above the plane: the lower ball is below, but is pushed up.
  BodyDef def = body_of(dumbbell(), {0, 0.1_r, 0});
  def.orientation = normalized(Quat{1, 1, 0, 0});
  def.acceleration = {};
  scene.bodies = {def, wall};
  World world(scene);
  ASSERT_EQ(world.step().contacts, 1u);
  EXPECT_EQ(world.contacts()[0].normal, (Vec3{0, 1, 0}));
  EXPECT_NEAR(world.contacts()[0].distance, -1.4, 16 * kEps);
}

TEST(Compound, IsHitByRaysAndOverlapsWithEachPart) {
  Scene scene;
  BodyDef wall;
  wall.shape = Plane{{0, 0, 1}, 20};
  wall.mass = 0;
  scene.bodies = {body_of(dumbbell(), {5, 0, 0}), wall};
  const World world(scene);
  const BodyId bodies[] = {world.bodies()[0], world.bodies()[1]};
  const auto by_ball = world.cast_ray({{0, 0, 1}, {1, 0, 0}});
  ASSERT_TRUE(by_ball.has_value());
  EXPECT_EQ(by_ball->body, bodies[0]);
  EXPECT_NEAR(by_ball->distance, 4.5, 16 * kEps);
  EXPECT_FALSE(world.cast_ray({{0, 0, 0}, {1, 0, 0}}).has_value());  // between the balls
  const auto lengthwise = world.cast_ray({{5, 0, 30}, {0, 0, -1}});
  ASSERT_TRUE(lengthwise.has_value());
  EXPECT_EQ(lengthwise->body, bodies[1]);  // the plane, from the front
  EXPECT_EQ(lengthwise->normal, (Vec3{0, 0, 1}));
  const auto outwards = world.cast_ray({{0, 0, 0}, {0, 0, 2}});
  ASSERT_TRUE(outwards.has_value());
  EXPECT_EQ(outwards->normal, (Vec3{0, 0, -1}));  // and from behind
  EXPECT_NEAR(outwards->distance, 20, 64 * kEps);
  EXPECT_EQ(world.overlapping(Sphere{0.6_r}, {5, 0, -2}), std::vector<BodyId>{bodies[0]});
  EXPECT_TRUE(world.overlapping(Sphere{0.4_r}, {5, 0, 0}).empty());
  EXPECT_EQ(world.overlapping(Box{{1, 1, 10.1_r}}, {5, 0, 10}).size(), 2u);
}

TEST(PlaneBody, ThatCouldMoveIsRefused) {
  Scene scene;
  scene.bodies.resize(1);
  scene.bodies[0].shape = Plane{};
  try {
    World world(scene);
    FAIL();
  } catch (const InvalidScene& error) {
    EXPECT_STREQ(error.what(),
                 "body 0: mass is 1; it must be 0 for a plane, which divides the whole world");
  }
}

}  // namespace
}  // namespace jfpx
