/// Tests of the forces of contact points: balance at rest, and the change of momentum in a step.
#include <jfpx/error.hpp>

#include "tests/world/random_bodies.hpp"
#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace jfpx {
namespace {

using test::operator""_r;

/// Sums over the contacts of a body, in double.
struct ForceOnBody {
  double force[3] = {}, torque[3] = {};
  int points = 0;

  void add(const Vec3& f, const Vec3& arm, const Vec3& extra, double side) {
    const double x[3] = {double{f.x}, double{f.y}, double{f.z}};
    const double r[3] = {double{arm.x}, double{arm.y}, double{arm.z}};
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      force[i] += side * x[i];
      torque[i] += side * (r[j] * x[k] - r[k] * x[j] + double{extra[i]});
    }
    ++points;
  }
};
std::vector<ForceOnBody> forces_by_index(const World& world) {
  std::vector<ForceOnBody> sums(world.bodies().size());
  for (const ContactForce& f : world.contact_forces()) {
    sums[f.a.index].add(f.force, f.arm_a, f.torque, 1);
    sums[f.b.index].add(f.force, f.arm_b, f.torque, -1);
  }
  return sums;
}

/// With one substep, the contacts change the momentum of a body by force times dt. Without bodies
/// of mass 0, at which a body that is pushed out of others may stop.
TEST(ContactForces, AreTheChangeOfMomentumInASubstep) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  std::size_t checked = 0, spins = 0;
  for (int k = 0; k < 10; ++k) {
    Scene scene;
    scene.soft_step.substeps = 1;
    scene.soft_step.restitution_threshold = 1000;  // balls do not collide with an impact
    for (int i = 0; i < 40; ++i) {
      BodyDef def = test::random_body(&random, 1.5_r);
      def.restitution = 0;
      def.velocity = random.uniform_in_box({-2, -2, -2}, {2, 2, 2});
      def.linear_damping = def.angular_damping = 1;
      if (random.below(2) == 0) def.rolling_friction = 0.1_r, def.spinning_friction = 0.05_r;
      if (def.mass > 0) scene.bodies.push_back(def);
    }
    World world(scene, {.threads = 2});
    for (int n = 0; n < 20; ++n) {
      const std::vector<BodyState> before = world.states();
      world.step();
      const std::vector<BodyState> after = world.states();
      const std::vector<ForceOnBody> forces = forces_by_index(world);
      for (std::size_t i = 0; i < before.size(); ++i) {
        const BodyId id = world.bodies()[i];
        const double mass = double{world.mass(id)}, dt = double{scene.dt};
        const Vec3 change = after[i].velocity - before[i].velocity;
        const Vec3 spin = after[i].angular_velocity - before[i].angular_velocity;
        double largest = 1;
        for (const double f : forces[i].force) largest = std::max(largest, std::abs(f));
        const double accuracy = 1e4 * test::kEps * (largest + mass / dt);
        for (int axis = 0; axis < 3; ++axis) {
          const double expected =
              mass * (double{change[axis]} / dt - double{world.last_acceleration(id)[axis]});
          ASSERT_NEAR(forces[i].force[axis], expected, accuracy) << "body " << i << ", step " << n;
          if (!std::holds_alternative<Sphere>(world.shape(id))) continue;
          const double turned = double{world.inertia(id)(0, 0)} * double{spin[axis]} / dt;
          ASSERT_NEAR(forces[i].torque[axis], turned, accuracy) << "body " << i << ", step " << n;
          spins += std::abs(turned) > 0.1;
        }
        checked += forces[i].points > 0;
      }
    }
  }
  EXPECT_GT(checked, 1000u);
  EXPECT_GT(spins, 100u);
}

/// Bodies at rest carry those above, also while they sleep.
TEST(ContactForces, CarryTheWeightOfAStack) {
  Scene scene;
  for (int i = 0; i < 4; ++i) {
    BodyDef def;
    def.shape = Box{{0.5_r, 0.5_r, 0.5_r}};
    def.mass = 10;
    def.position.y = 0.5_r + Real(i);
    scene.bodies.push_back(def);
  }
  scene.bodies.push_back(test::ground());
  World world(scene);
  EXPECT_TRUE(world.contact_forces().empty());
  for (int n = 0; n < 600; ++n) world.step();
  EXPECT_FALSE(world.awake(world.bodies()[0]));
  double below[4] = {};
  for (const ContactForce& f : world.contact_forces()) {
    const bool of_ground = f.b.index == 4;
    const std::uint32_t upper = of_ground ? f.a.index : std::max(f.a.index, f.b.index);
    const double up = double{f.force.y} * (f.a.index == upper ? 1 : -1);
    below[upper] += up;
    EXPECT_GT(dot(f.force, f.normal), 0);
    EXPECT_NEAR(double{length(f.arm_a)}, std::sqrt(0.75), 0.01);
  }
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(below[i], 10 * test::kG * (4 - i), 0.5) << i;

  // As contacts(), until the next step.
  world.remove(world.bodies()[3]);
  EXPECT_TRUE(world.contact_forces().empty());
  world.step();
  EXPECT_EQ(world.contact_forces().size(), 12u);
}

/// A ball rests on a slope by friction and rolling friction: force and torque are in balance.
TEST(ContactForces, OfABallOnASlopeBalanceItsWeight) {
  const double angle = 0.2;
  Scene scene;
  BodyDef def = test::heavy({});
  const Vec3 normal{static_cast<Real>(std::sin(angle)), static_cast<Real>(std::cos(angle)), 0};
  def.position = normal * 0.9999_r;
  def.friction = 1;
  def.rolling_friction = 0.5_r;
  def.can_sleep = false;
  scene.bodies = {def, test::half_space(normal, 0)};
  scene.bodies[1].friction = 1;
  World world(scene);
  for (int n = 0; n < 120; ++n) world.step();
  ASSERT_EQ(world.contact_forces().size(), 1u);
  const ContactForce& f = world.contact_forces()[0];
  EXPECT_EQ(f.a, world.bodies()[0]);
  EXPECT_NEAR(double{f.force.x}, 0, 1e-3);
  EXPECT_NEAR(double{f.force.y}, test::kG, 1e-3);
  EXPECT_NEAR(double{f.torque.z}, test::kG * std::sin(angle), 5e-3);
  const ForceOnBody sum = forces_by_index(world)[0];
  for (const double torque : sum.torque) EXPECT_NEAR(torque, 0, 5e-3);
}

TEST(ContactForces, FollowWithTheNextStepOfASnapshot) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  Scene scene;
  scene.bodies.push_back(test::ground());
  for (int i = 0; i < 60; ++i) {
    scene.bodies.push_back(test::random_body(&random, 2));
    scene.bodies.back().position.y += 2;
  }
  World world(scene, {.threads = 3});
  for (const int steps : {100, 800}) {  // then most bodies are asleep
    for (int n = 0; n < steps; ++n) world.step();
    World other{Scene{}};
    other.restore(world.snapshot());
    EXPECT_TRUE(other.contact_forces().empty());
    for (World* w : {&world, &other}) {
      w->wake(w->bodies().back());
      w->step();
    }
    const auto forces = world.contact_forces();
    EXPECT_GT(forces.size(), 50u);
    EXPECT_TRUE(std::ranges::equal(other.contact_forces(), forces)) << steps;
  }
}

/// A push by a contact generator.
struct Push {
  BodyId body, from;
  void operator()(ContactContext& context) const {
    context.add({.a = body, .b = from, .normal = {0, 1, 0}, .point = {}, .distance = 0});
  }
};

TEST(ContactForces, IncludeContactGeneratorsAndExcludeSensors) {
  Scene scene;
  BodyDef def = test::ball({0, 1, 0}), sensor = test::ball({0, 1, 0});
  def.acceleration = {0, -9.81_r, 0};
  sensor.sensor = true;
  scene.bodies = {def, test::ball({0, -5, 0}), sensor};
  scene.bodies[1].mass = 0;
  World world(scene);
  world.add_contact_generator(Push{world.bodies()[0], world.bodies()[1]});
  for (int n = 0; n < 10; ++n) world.step();
  EXPECT_GT(world.contacts().size(), 1u);
  ASSERT_EQ(world.contact_forces().size(), 1u);
  EXPECT_NEAR(double{world.contact_forces()[0].force.y}, test::kG, 1e-2);
}

TEST(ContactForces, OfWorstFirstAreNone) {
  Scene scene = test::thesis_scene();
  scene.bodies = {test::heavy({0, 0.9_r, 0}), test::ground()};
  World world(scene);
  world.step();
  EXPECT_EQ(world.contacts().size(), 1u);
  EXPECT_TRUE(world.contact_forces().empty());
}

}  // namespace
}  // namespace jfpx
