/// Solids that slide over a flat floor with seams.
#pragma once

#include "tests/world/meshes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// A solid that lies on the plane y = 0, and moves in a direction of that plane.
struct Slider {
  const char* name;
  Shape shape;
  Real height;
  Quat orientation = {};
};

/// Slides over seams of different directions at different speeds, without friction.
/// @param floor immovable bodies without friction
/// @param most  [m], by which the height may change
inline void expect_to_slide(const Slider& slider, const std::vector<BodyDef>& floor, Real most) {
  for (const Real speed : {0.3_r, 1.0_r, 5.0_r, 20.0_r}) {
    for (const Vec3& direction : {Vec3{1, 0, 0}, Vec3{0.6_r, 0, 0.8_r}}) {
      SCOPED_TRACE(std::string(slider.name) + " at " + std::to_string(speed));
      Scene scene;
      scene.sleep.enabled = false;
      scene.bodies = floor;
      BodyDef body;
      body.shape = slider.shape;
      body.orientation = slider.orientation;
      body.friction = 0;
      body.position = Vec3{0.13_r, slider.height, 0.21_r} - direction * 20;
      body.velocity = direction * speed;
      scene.bodies.push_back(body);
      World world(scene);
      Real change = 0;
      const int steps = speed < 1 ? 900 : static_cast<int>(40 * 60 / speed);
      for (int n = 0; n < steps; ++n) {
        world.step();
        const Real height = world.state(world.bodies().back()).position.y;
        change = std::max(change, absolute(height - slider.height));
      }
      EXPECT_LT(change, most);
      EXPECT_NEAR(length(world.state(world.bodies().back()).velocity), speed, 0.005_r * speed);
    }
  }
}

inline void expect_to_slide(const Slider& slider, const Shape& floor, Real most) {
  expect_to_slide(slider, std::vector<BodyDef>{fixed_surface(floor, 0)}, most);
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
