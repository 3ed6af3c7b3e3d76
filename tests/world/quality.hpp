/// Measurements of worlds for the tests of the solver's quality.
#pragma once

#include <jfpx/world.hpp>

#include "src/scenes/scenes.hpp"
#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

inline constexpr double kGravity = 9.81;

inline Scene awake(Scene scene) {
  scene.sleep.enabled = false;
  return scene;
}
inline BodyDef crate(const Vec3& position, const Vec3& half_extents, Real mass = 1) {
  BodyDef def;
  def.shape = Box{half_extents};
  def.mass = mass;
  def.position = position;
  return def;
}
/// A ball with gravity and friction, unlike ball().
inline BodyDef heavy_ball(const Vec3& position, Real radius, Real mass = 1) {
  BodyDef def = crate(position, {}, mass);
  def.shape = Sphere{radius};
  return def;
}

inline std::vector<BodyState> states_of(const World& world) { return world.states(); }
inline void run(World* world, double seconds) {
  const auto steps = std::lround(seconds / static_cast<double>(world->settings().dt));
  for (long i = 0; i < steps; ++i) world->step();
}
/// [s], time after which all bodies sleep; the limit if they do not.
inline double time_to_sleep(World* world, double limit) {
  while (world->time() < limit && world->step().awake > 0) continue;
  return world->time();
}

/// [m], largest distance of a body from its position in `before`.
inline double drift(const World& world, const std::vector<BodyState>& before) {
  Real most = 0;
  const std::vector<BodyState> states = world.states();
  for (std::size_t i = 0; i < before.size(); ++i) {
    most = std::max(most, length(states[i].position - before[i].position));
  }
  return static_cast<double>(most);
}

struct Penetration {
  double mean = 0, largest = 0;  ///< [m]
};
inline Penetration penetration(const World& world) {
  Penetration result;
  for (const Contact& contact : world.contacts()) {
    const double depth = static_cast<double>(-contact.distance);
    result.mean += depth / static_cast<double>(world.contacts().size());
    result.largest = std::max(result.largest, depth);
  }
  return result;
}

struct Speeds {
  double rms = 0, largest = 0;  ///< [m/s]
};
inline Speeds speeds(const World& world) {
  Speeds result;
  double squares = 0, count = 0;
  const std::vector<BodyState> states = world.states();
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (!(world.mass(world.bodies()[i]) > 0)) continue;
    const auto speed = static_cast<double>(length(states[i].velocity));
    squares += speed * speed;
    count += 1;
    result.largest = std::max(result.largest, speed);
  }
  result.rms = std::sqrt(squares / count);
  return result;
}

/// Runs the scene `heap`: penetrations and speeds are small after 10 s, and all bodies sleep
/// after 15.
inline void expect_heap_comes_to_rest(World* world) {
  constexpr double kSmallestRadius = 0.45;
  run(world, 10);
  const Penetration depth = penetration(*world);
  EXPECT_LE(depth.mean, 0.01 * kSmallestRadius);
  EXPECT_LE(depth.largest, 0.06 * kSmallestRadius);
  EXPECT_LE(speeds(*world).rms, 0.002);
  EXPECT_LT(time_to_sleep(world, 15), 15);
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
