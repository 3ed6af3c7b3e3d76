/// What tests of moving solids and of distances share.
#pragma once

#include <jfpx/world.hpp>

#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <utility>
#include <variant>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

inline constexpr Real kQueryTolerance = sizeof(Real) == 4 ? 1e-5_r : 1e-13_r;

inline void expect_near_vector(const Vec3& a, const Vec3& b, Real tolerance = kQueryTolerance) {
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(a[i], b[i], tolerance) << i;
}

inline BodyDef fixed_body(const Shape& shape, const Vec3& position = {}) {
  BodyDef def;
  def.shape = shape;
  def.position = position;
  def.mass = 0;
  return def;
}

inline World query_world(std::vector<BodyDef> bodies) {
  Scene scene;
  scene.bodies = std::move(bodies);
  return World(scene);
}

/// Each solid that is 1 m high and about 1 m wide.
inline std::vector<SolidShape> all_solids() {
  return {Sphere{0.5_r}, Box{{0.4_r, 0.5_r, 0.3_r}}, Capsule{0.25_r, 0.25_r},
          Hull{},        Cylinder{0.4_r, 0.5_r},     Cone{0.4_r, 0.5_r}};
}
/// [m], from the origin of one of all_solids(), or of a sphere, to the lowest point.
inline Real depth_below(const SolidShape& solid) {
  const Sphere* ball = std::get_if<Sphere>(&solid);
  if (ball != nullptr) return ball->radius;
  return std::holds_alternative<Cone>(solid) ? 0.25_r : 0.5_r;
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
