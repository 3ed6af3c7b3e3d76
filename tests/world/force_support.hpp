/// Worlds of a few balls for tests of forces.
#pragma once

#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// Suites with tests in several files; force_test.cpp instantiates them.
class Erratum : public SolverTest {};
class BuoyancyForce : public SolverTest {};

/// Balls of mass 2 and radius 1 without gravity, to be placed so that they do not touch.
inline World world_of(std::vector<BodyDef> bodies, Real dt, Solver solver) {
  Scene scene;
  scene.solver = solver;
  scene.dt = dt;
  scene.bodies = std::move(bodies);
  return World(scene);
}
inline World world_of(std::vector<BodyDef> bodies, Real dt = Real(0.01)) {
  return world_of(std::move(bodies), dt, SolverTest::GetParam());
}
inline BodyDef ball_at(const Vec3& position, const Vec3& velocity = {}) {
  BodyDef def = ball(position, 1, 2);
  def.velocity = velocity;
  return def;
}
inline void expect_near(const Vec3& actual, const Vec3& expected, double tolerance) {
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(actual[i], expected[i], tolerance) << "xyz"[i];
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
