/// Tests of particles: flight, bounces and rest against formulas; ids, bad input, determinism.
#include <jfpx/error.hpp>
#include <jfpx/thesis/particle.hpp>

#include "tests/world/support.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace jfpx {
namespace {

using test::operator""_r;
using test::kEps;
using test::kNan;
using ::testing::HasSubstr;

constexpr HalfSpace kGround{{0, 1, 0}, 0};

/// A particle without gravity.
ParticleDef free_particle(const Vec3& position, const Vec3& velocity = {}, Real radius = 0) {
  ParticleDef def;
  def.position = position;
  def.velocity = velocity;
  def.acceleration = {};
  def.radius = radius;
  return def;
}

void step(ParticleWorld* world, int steps) {
  for (int n = 0; n < steps; ++n) EXPECT_FALSE(world->step().non_finite);
}

TEST(Particle, FliesAsAProjectileWithDrag) {
  // Artillery of the thesis: v_n = q (v_{n-1} + a dt) has a closed form, and so has its sum.
  ParticleDef def;
  def.mass = 200;
  def.velocity = {0, 30, 40};
  def.acceleration = {0, -20, 0};
  def.damping = 0.99_r;
  const double dt = 0.01, q = std::pow(0.99, dt);
  ParticleWorld world({.dt = 0.01_r});
  const ParticleId id = world.add(def);
  step(&world, 300);
  const double qn = std::pow(q, 300), limit = -20 * dt * q / (1 - q);
  const double sum = q * (1 - qn) / (1 - q);  // of q^1 ... q^300
  EXPECT_NEAR(world.state(id).velocity.y, limit + (30 - limit) * qn, 3e4 * kEps);
  EXPECT_NEAR(world.state(id).velocity.z, 40 * qn, 1e4 * kEps);
  EXPECT_NEAR(world.state(id).position.y, dt * (300 * limit + (30 - limit) * sum), 1e5 * kEps);
  EXPECT_NEAR(world.state(id).position.z, dt * 40 * sum, 1e5 * kEps);
}

TEST(Particle, ConvergesToTheExactFlightWithShorterSteps) {
  // dv/dt = a - k v with k = -ln(damping): y(1 s) in closed form. The error is proportional to dt.
  const double k = -std::log(0.5), a = -9.81;
  const double y = (5 - a / k) * (1 - std::exp(-k)) / k + a / k;
  double error[2];
  for (const int i : {0, 1}) {
    ParticleDef def;
    def.velocity = {0, 5, 0};
    def.damping = 0.5_r;
    const int steps = i == 0 ? 50 : 200;
    ParticleWorld world({.dt = Real(1) / static_cast<Real>(steps)});
    const ParticleId id = world.add(def);
    step(&world, steps);
    error[i] = std::abs(world.state(id).position.y - y);
  }
  EXPECT_LT(error[0], 0.1);
  EXPECT_NEAR(error[0] / error[1], 4, 0.3);
}

TEST(Particle, AForceActsOnOneStepByMass) {
  ParticleWorld world({.dt = 0.5_r});
  ParticleDef def = free_particle({});
  def.mass = 4;
  const ParticleId id = world.add(def);
  world.apply_force(id, {8, 0, 0});
  world.apply_force(id, {0, 4, 0});
  step(&world, 1);
  EXPECT_EQ(world.state(id).velocity, (Vec3{1, 0.5_r, 0}));
  EXPECT_EQ(world.state(id).position, (Vec3{0.5_r, 0.25_r, 0}));  // velocity first, then position
  step(&world, 1);
  EXPECT_EQ(world.state(id).velocity, (Vec3{1, 0.5_r, 0}));
}

TEST(Particle, DampingIsTheShareKeptPerSecond) {
  ParticleWorld world({.dt = 0.125_r});
  ParticleDef def = free_particle({}, {16, 0, 0});
  def.damping = 0.25_r;
  const ParticleId id = world.add(def);
  step(&world, 16);  // two seconds
  EXPECT_NEAR(world.state(id).velocity.x, 1, 100 * kEps);
}

TEST(Particle, ElasticHitOfUnequalMassesKeepsMomentumAndEnergy) {
  ParticleWorld world({.dt = 0.01_r});
  ParticleDef heavy = free_particle({0, 0, 0}, {2, 0, 0}, 0.5_r), light = heavy;
  heavy.mass = 3;
  heavy.restitution = light.restitution = 1;
  light.position = {1.05_r, 0, 0};
  light.velocity = {-2, 0, 0};
  const ParticleId a = world.add(heavy), b = world.add(light);
  step(&world, 10);
  // u1 = ((m1 - m2) v1 + 2 m2 v2) / (m1 + m2), u2 by symmetry.
  EXPECT_NEAR(world.state(a).velocity.x, 0, 100 * kEps);
  EXPECT_NEAR(world.state(b).velocity.x, 4, 100 * kEps);
}

TEST(Particle, RestitutionIsTheRatioOfSpeeds) {
  for (const Real e : {0.0_r, 0.3_r, 1.0_r}) {
    ParticleWorld world({.dt = 0.01_r, .grounds = {kGround}});
    ParticleDef def = free_particle({0, 0.05_r, 0}, {1, -10, 0});
    def.restitution = e;
    const ParticleId id = world.add(def);
    step(&world, 2);
    EXPECT_NEAR(world.state(id).velocity.y, 10 * e, 100 * kEps);
    EXPECT_EQ(world.state(id).velocity.x, 1);  // no friction
  }
}

TEST(Particle, AnImpulsePropagatesThroughARow) {
  ParticleWorld world({.dt = 0.01_r});
  std::vector<ParticleId> row;
  for (int i = 0; i < 6; ++i) {
    ParticleDef def = free_particle({static_cast<Real>(i) * 1.001_r, 0, 0}, {}, 0.5_r);
    def.restitution = 1;
    if (i == 0) def.position.x = -1, def.velocity.x = 5;
    row.push_back(world.add(def));
  }
  step(&world, 60);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(world.state(row[i]).velocity.x, 0, 1e-4) << i;
  EXPECT_NEAR(world.state(row[5]).velocity.x, 5, 1e-4);
}

TEST(Particle, ComesToRestOnTheGroundAndStays) {
  ParticleWorld world({.grounds = {kGround}});
  ParticleDef point, ball;
  point.position = {0, 2, 0};
  ball.position = {5, 2, 0};
  ball.radius = 0.5_r;
  point.restitution = ball.restitution = 0.5_r;
  const ParticleId a = world.add(point), b = world.add(ball);
  step(&world, 600);
  const Vec3 at = world.state(a).position;
  EXPECT_NEAR(at.y, 0, 1.1e-4);
  EXPECT_NEAR(world.state(b).position.y, 0.5, 1.1e-4);
  EXPECT_EQ(world.contacts().size(), 2u);
  step(&world, 600);
  EXPECT_EQ(world.state(a).position, at);
  EXPECT_EQ(world.state(a).velocity, Vec3{});
}

TEST(Particle, AStackStands) {
  ParticleWorld world({.dt = 0.005_r, .grounds = {kGround}});
  std::vector<ParticleId> stack;
  for (int i = 0; i < 5; ++i) {
    ParticleDef def;
    def.radius = 0.5_r;
    def.position = {0, 0.5_r + static_cast<Real>(i), 0};
    stack.push_back(world.add(def));
  }
  step(&world, 2000);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_NEAR(world.state(stack[i]).position.y, 0.5 + static_cast<double>(i), 2e-3) << i;
  }
}

TEST(Particle, PointsMeetGroundsButNotEachOther) {
  ParticleWorld world({.grounds = {kGround}});
  world.add(free_particle({0, 1, 0}));
  world.add(free_particle({0, 1, 0}));
  world.add(free_particle({0, 1, 0}, {}, 0.5_r));
  step(&world, 1);
  EXPECT_TRUE(world.contacts().empty());
}

TEST(Particle, ContactsComeInOrderAndPointTowardsA) {
  ParticleWorld world({.grounds = {kGround, {{1, 0, 0}, -5}}});
  world.add(free_particle({0, 0.25_r, 0}, {}, 0.5_r));
  world.add(free_particle({0.5_r, 0.25_r, 0}, {}, 0.5_r));
  world.add(free_particle({-5, 7, 0}));
  step(&world, 1);
  ASSERT_EQ(world.contacts().size(), 4u);
  const auto c = world.contacts();
  EXPECT_EQ(c[0].a, 0u);
  EXPECT_EQ(c[0].b, 1u);
  EXPECT_EQ(c[0].normal, (Vec3{-1, 0, 0}));
  EXPECT_EQ(c[0].distance, -0.5_r);
  EXPECT_EQ(c[1].b, ParticleContact::kNoParticle);
  EXPECT_EQ(c[1].distance, -0.25_r);
  EXPECT_EQ(c[3].a, 2u);
  EXPECT_EQ(c[3].normal, (Vec3{1, 0, 0}));
  EXPECT_EQ(c[3].distance, 0);  // an exact touch counts
}

TEST(Erratum, E19_nothing_moves_an_immovable_particle) {
  ParticleWorld world({.grounds = {{{0, 1, 0}, 10}}});  // inside the ground
  ParticleDef def;
  def.mass = 0;
  def.velocity = {1, 2, 3};
  def.radius = 1;
  const ParticleId wall = world.add(def);
  ParticleDef hammer = free_particle({0, 30, 0}, {0, -30, 0}, 1);
  const ParticleId id = world.add(hammer);
  for (int n = 0; n < 60; ++n) {
    world.apply_force(wall, {100, 100, 100});
    step(&world, 1);
  }
  EXPECT_EQ(world.state(wall), ParticleState{});
  EXPECT_GE(world.state(id).position.y, 10);
}

TEST(Particle, AGasKeepsItsMomentumAndNeverGainsEnergy) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  ParticleWorld world({.dt = 0.01_r, .grounds = {}});
  std::vector<Real> masses;
  for (int i = 0; i < 200; ++i) {
    ParticleDef def =
        free_particle(random.uniform_in_box({-3, -3, -3}, {3, 3, 3}),
                      random.uniform_in_box({-5, -5, -5}, {5, 5, 5}), random.uniform(0.1_r, 0.6_r));
    def.mass = random.uniform(0.1_r, 10);
    def.restitution = random.uniform(0, 1);
    masses.push_back(def.mass);
    world.add(def);
  }
  double momentum[2][3] = {}, energy[2] = {};
  const auto sum = [&](int when) {
    for (std::size_t i = 0; i < masses.size(); ++i) {
      const Vec3 v = world.state(world.particles()[i]).velocity;
      for (int k = 0; k < 3; ++k) momentum[when][k] += static_cast<double>(masses[i] * v[k]);
      energy[when] += 0.5 * static_cast<double>(masses[i] * length_squared(v));
    }
  };
  sum(0);
  std::uint64_t hits = 0;
  for (int n = 0; n < 100; ++n) hits += world.step().velocity_iterations;
  sum(1);
  EXPECT_GT(hits, 100u);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(momentum[1][k], momentum[0][k], 3e5 * kEps);
  EXPECT_LT(energy[1], energy[0] * (1 + 100 * kEps));
}

TEST(Particle, HasTheSameBitsWithAnyColliderAndRepeat) {
  std::vector<ParticleState> first;
  const SphereColliderOptions ways[] = {
      {.algorithm = SphereAlgorithm::all_pairs},
      {.algorithm = SphereAlgorithm::all_pairs},
      {.algorithm = SphereAlgorithm::all_pairs, .threads = 3},  // threads process blocks of 64 rows
      {.algorithm = SphereAlgorithm::grid, .threads = 3, .simd = SimdLevel::scalar}};
  for (const SphereColliderOptions& collider : ways) {
    Random random(7);
    ParticleWorld world({.grounds = {kGround}, .collider = collider});
    for (int i = 0; i < 300; ++i) {
      ParticleDef def;
      def.position = random.uniform_in_box({-3, 0, -3}, {3, 6, 3});
      def.radius = 0.3_r;
      def.restitution = 0.5_r;
      world.add(def);
    }
    step(&world, 100);
    std::vector<ParticleState> states;
    for (const ParticleId id : world.particles()) states.push_back(world.state(id));
    if (first.empty()) first = states;
    EXPECT_EQ(states, first);
  }
}

TEST(Particle, IdsOfRemovedParticlesAreNeverReused) {
  ParticleWorld world;
  const ParticleId a = world.add({}), b = world.add({});
  world.remove(a);
  EXPECT_FALSE(world.contains(a));
  EXPECT_THROW(world.remove(a), InvalidArgument);
  EXPECT_THROW(world.state(a), InvalidArgument);
  EXPECT_THROW(world.apply_force(a, {}), InvalidArgument);
  EXPECT_THROW(world.set_state({}, {}), InvalidArgument);
  const ParticleId c = world.add(free_particle({1, 2, 3}));
  EXPECT_EQ(c.index, a.index);
  EXPECT_NE(c, a);
  ASSERT_EQ(world.particles().size(), 2u);
  EXPECT_EQ(world.particles()[0], c);
  EXPECT_EQ(world.particles()[1], b);
  EXPECT_EQ(world.state(c).position, (Vec3{1, 2, 3}));
}

TEST(Particle, AnEmptyWorldSteps) {
  ParticleWorld world({.grounds = {kGround}});
  EXPECT_EQ(world.step().step, 1u);
  EXPECT_EQ(world.step().step, 2u);
  EXPECT_EQ(world.time(), 2 * static_cast<double>(Real(1) / Real(60)));
}

TEST(Particle, ARunawayIsNamedAndTheStateKept) {
  ParticleWorld world({.dt = 1});
  const ParticleId still = world.add(free_particle({1, 2, 3}));
  const ParticleId fast = world.add(free_particle({}, {kMaxCoordinate * 2, 0, 0}));
  const ParticleReport report = world.step();
  EXPECT_TRUE(report.non_finite);
  EXPECT_EQ(report.non_finite_particle, fast);
  EXPECT_EQ(report.step, 0u);
  EXPECT_EQ(world.state(fast).position, Vec3{});
  world.remove(fast);
  EXPECT_FALSE(world.step().non_finite);
  EXPECT_EQ(world.state(still).position, (Vec3{1, 2, 3}));
}

TEST(Particle, BadFieldsAreNamedWithValueAndRange) {
  const auto complaint = [](auto change) -> std::string {
    ParticleDef def;
    change(&def);
    try {
      ParticleWorld().add(def);
    } catch (const InvalidArgument& error) {
      return error.what();
    }
    return "nothing";
  };
  constexpr Real kInf = std::numeric_limits<Real>::infinity();
  const auto mass = [&](Real m) { return complaint([m](ParticleDef* d) { d->mass = m; }); };
  EXPECT_THAT(mass(-1), HasSubstr("mass is -1; it must be finite and >= 0"));
  EXPECT_THAT(mass(kNan), HasSubstr("mass"));
  EXPECT_THAT(mass(std::numeric_limits<Real>::denorm_min()), HasSubstr("inverse"));
  EXPECT_THAT(complaint([](ParticleDef* d) { d->position.y = 2 * kMaxCoordinate; }),
              HasSubstr("position"));
  EXPECT_THAT(complaint([](ParticleDef* d) { d->velocity.x = kNan; }), HasSubstr("velocity"));
  EXPECT_THAT(complaint([](ParticleDef* d) { d->acceleration.z = kInf; }),
              HasSubstr("acceleration"));
  EXPECT_THAT(complaint([](ParticleDef* d) { d->damping = 0; }), HasSubstr("damping is 0"));
  EXPECT_THAT(complaint([](ParticleDef* d) { d->damping = 1.5_r; }), HasSubstr("damping"));
  EXPECT_THAT(complaint([](ParticleDef* d) { d->radius = -1; }), HasSubstr("radius is -1"));
  EXPECT_THAT(complaint([](ParticleDef* d) { d->restitution = 2; }), HasSubstr("restitution is 2"));
  ParticleWorld world;
  const ParticleId id = world.add({});
  EXPECT_THROW(world.apply_force(id, {kNan, 0, 0}), InvalidArgument);
  EXPECT_THROW(world.set_state(id, {{kInf, 0, 0}, {}}), InvalidArgument);
}

TEST(Particle, ContinuesFromTheStateThatIsSet) {
  ParticleWorld moved, made;
  const ParticleId id = moved.add({});
  moved.step();
  moved.set_state(id, {{1, 2, 3}, {4, 5, 6}});
  ParticleDef def;
  def.position = {1, 2, 3};
  def.velocity = {4, 5, 6};
  const ParticleId twin = made.add(def);
  for (int n = 0; n < 3; ++n) {
    EXPECT_EQ(moved.state(id), made.state(twin));
    moved.step();
    made.step();
  }
}

TEST(Particle, BadSettingsAreRefused) {
  const auto refused = [](const ParticleSettings& settings) {
    EXPECT_THROW(ParticleWorld{settings}, InvalidArgument);
  };
  refused({.dt = 0});
  refused({.dt = -1});
  refused({.dt = std::numeric_limits<Real>::denorm_min()});
  refused({.grounds = {{{0, 2, 0}, 0}}});
  refused({.grounds = {{{0, 1, 0}, 2 * kMaxCoordinate}}});
  refused({.velocity_epsilon = 0});
  refused({.position_epsilon = -1});
  refused({.restitution_velocity = -1});
}

}  // namespace
}  // namespace jfpx
