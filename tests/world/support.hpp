/// Small scenes and conserved quantities for the tests of worlds.
#pragma once

#include <jfpx/random.hpp>
#include <jfpx/world.hpp>

#include "src/collide/shapes.hpp"
#include "src/scene/inertia.hpp"
#include "src/world/bodies/body_store.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>
#include <random>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// A Real from a decimal literal.
constexpr Real operator""_r(long double value) { return static_cast<Real>(value); }

inline constexpr Real kNan = std::numeric_limits<Real>::quiet_NaN();
inline constexpr Real kInfinity = std::numeric_limits<Real>::infinity();
inline constexpr double kEps = static_cast<double>(kEpsilon);
inline constexpr double kPiD = 3.14159265358979323846;
inline constexpr double kG = 9.81;  ///< [m/s^2]

/// A fresh seed, or that of JFPX_TEST_SEED. Report it with SCOPED_TRACE.
inline std::uint64_t fresh_seed() {
  if (const char* fixed = std::getenv("JFPX_TEST_SEED")) return std::strtoull(fixed, nullptr, 0);
  std::random_device device;
  return (std::uint64_t{device()} << 32) | device();
}
inline std::string trace(std::uint64_t seed) { return "JFPX_TEST_SEED=" + std::to_string(seed); }

/// An empty scene of the thesis' resolver.
inline Scene thesis_scene() {
  Scene scene;
  scene.solver = Solver::worst_first;
  return scene;
}

inline constexpr Solver kSolvers[] = {Solver::soft_step, Solver::worst_first};

/// Fixture of tests that hold for every solver, or for any.
using SolverTest = testing::TestWithParam<Solver>;
/// An empty scene for the solver of a SolverTest.
inline Scene empty_scene() {
  Scene scene;
  scene.solver = SolverTest::GetParam();
  return scene;
}
/// Number of integrations in a step with this scene, with forces of the start of the step.
inline int substeps(const Scene& scene) {
  return scene.solver == Solver::soft_step ? static_cast<int>(scene.soft_step.substeps) : 1;
}
inline std::string solver_name(const testing::TestParamInfo<Solver>& info) {
  return to_string(info.param);
}
/// Runs the TEST_P of a suite with each solver.
#define JFPX_INSTANTIATE_SOLVERS(Suite)                                               \
  INSTANTIATE_TEST_SUITE_P(Solvers, Suite, testing::ValuesIn(::jfpx::test::kSolvers), \
                           ::jfpx::test::solver_name)
/// Defines a suite of tests of solver-specific behaviour.
#define JFPX_SOLVER_SUITE(Suite)                    \
  class Suite : public ::jfpx::test::SolverTest {}; \
  JFPX_INSTANTIATE_SOLVERS(Suite)
/// Defines a suite of solver-independent tests, run with Solver::soft_step only.
#define JFPX_INSTANTIATE_SOFT_STEP(Suite)                                              \
  INSTANTIATE_TEST_SUITE_P(Solvers, Suite, testing::Values(::jfpx::Solver::soft_step), \
                           ::jfpx::test::solver_name)
#define JFPX_SOFT_STEP_SUITE(Suite)                 \
  class Suite : public ::jfpx::test::SolverTest {}; \
  JFPX_INSTANTIATE_SOFT_STEP(Suite)

/// A ball without gravity, damping, friction and sleep.
inline BodyDef ball(const Vec3& position, Real radius = 1, Real mass = 1) {
  BodyDef def;
  def.shape = Sphere{radius};
  def.mass = mass;
  def.position = position;
  def.acceleration = {};
  def.friction = 0;
  def.can_sleep = false;
  return def;
}
/// A ball that falls and can sleep.
inline BodyDef heavy(const Vec3& position) {
  BodyDef def = ball(position);
  def.acceleration = {0, Real(-9.81), 0};
  def.can_sleep = true;
  return def;
}
inline BodyDef half_space(const Vec3& normal, Real offset) {
  BodyDef def;
  def.shape = HalfSpace{normal, offset};
  def.mass = 0;
  return def;
}
inline BodyDef ground() { return half_space({0, 1, 0}, 0); }
inline Scene scene_of(std::vector<BodyDef> bodies) {
  Scene scene = empty_scene();
  scene.bodies = std::move(bodies);
  return scene;
}
inline World world_with(std::vector<BodyDef> bodies) { return World(scene_of(std::move(bodies))); }
inline Scene on_the_ground(std::vector<BodyDef> bodies) {
  bodies.push_back(ground());
  return scene_of(std::move(bodies));
}

/// Expects that a stack of ten bodies like the lowest moves less than a millimetre in ten seconds.
/// With soft contacts, it first sinks by at most three centimetres, until the overlaps carry the
/// weight.
inline void expect_that_ten_stand(const BodyDef& lowest, Real height) {
  Scene scene = empty_scene();
  for (int i = 0; i < 10; ++i) {
    scene.bodies.push_back(lowest);
    // An overlap of a hundredth of a millimetre, so that all touch despite rounding.
    scene.bodies.back().position.y += (height - Real(1e-5)) * static_cast<Real>(i);
  }
  scene.bodies.push_back(ground());
  scene.resolver.position_epsilon = Real(5e-5);  // ten of them add up to half a millimetre
  scene.resolver.velocity_epsilon = Real(1e-3);
  scene.resolver.max_iterations = 100000;
  scene.soft_step.contact_hertz = 30;
  World world(scene);
  std::vector<BodyState> start = world.states();
  if (scene.solver == Solver::soft_step) {
    for (int n = 0; n < 900; ++n) world.step();
    for (std::size_t i = 0; i < 10; ++i) {
      ASSERT_LT(length(world.states()[i].position - start[i].position), Real(0.03)) << i;
    }
    start = world.states();
  }
  bool exhausted = false;
  for (int n = 0; n < 600; ++n) {
    exhausted |= world.step().iterations_exhausted;
    const auto states = world.states();
    for (std::size_t i = 0; i < 10; ++i) {
      ASSERT_LT(length(states[i].position - start[i].position), Real(1e-3)) << n << ", body " << i;
    }
  }
  EXPECT_FALSE(exhausted);
}

/// Sums over the movable bodies of a world, in double.
struct Sums {
  double energy = 0;  ///< kinetic
  double momentum[3] = {}, angular_momentum[3] = {};
  double scale = 0;  ///< magnitude of the momenta, for tolerances
};
inline Sums sums(std::span<const BodyDef> bodies, std::span<const BodyState> states) {
  Sums total;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const double m = static_cast<double>(bodies[i].mass);
    if (!(m > 0)) continue;
    const BodyState& s = states[i];
    const double inertia = static_cast<double>(
        detail::moments_of_inertia(std::get<Sphere>(bodies[i].shape), bodies[i].mass).x);
    const double x[3] = {s.position.x, s.position.y, s.position.z};
    const double v[3] = {s.velocity.x, s.velocity.y, s.velocity.z};
    const double w[3] = {s.angular_velocity.x, s.angular_velocity.y, s.angular_velocity.z};
    for (int k = 0; k < 3; ++k) {
      const int j = (k + 1) % 3, l = (k + 2) % 3;
      total.energy += 0.5 * (m * v[k] * v[k] + inertia * w[k] * w[k]);
      total.momentum[k] += m * v[k];
      total.angular_momentum[k] += m * (x[j] * v[l] - x[l] * v[j]) + inertia * w[k];
      total.scale += m * std::abs(v[k]) * (1 + std::abs(x[j]) + std::abs(x[l]));
    }
  }
  return total;
}
/// Shapes, masses and accelerations of the bodies, in the order of their states.
inline std::vector<BodyDef> definitions(const World& world) {
  std::vector<BodyDef> definitions;
  for (const BodyId id : world.bodies()) {
    BodyDef def;
    def.shape = world.shape(id);
    def.mass = world.mass(id);
    def.acceleration = world.acceleration(id);
    definitions.push_back(def);
  }
  return definitions;
}
inline Sums sums(const World& world) { return sums(definitions(world), world.states()); }

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
