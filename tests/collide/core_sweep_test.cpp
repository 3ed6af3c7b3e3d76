/// Sweep of a ball to fixed shapes.
#include "src/collide/core_sweep.hpp"

#include "tests/world/random_bodies.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace jfpx {
namespace {

using test::operator""_r;

/// Compares the first touch with the distances at many points of the path.
template <class S>
void expect_first_touch(const detail::CoreMotion& core, const S& shape) {
  const auto distance_at = [&](Real t) {
    return detail::point_separation(add_scaled(core.from, core.motion, t), shape).distance;
  };
  Real t = 2;
  const bool touches = sweep_core(core, shape, &t);
  const Real start = distance_at(0);
  if (!(start > core.error)) {  // nearer than the rounding: outside or inside
    EXPECT_FALSE(touches && !(start > 0));
    return;
  }
  const Real target = std::min(core.radius, start * 0.9375_r);
  if (touches) {
    EXPECT_NEAR(distance_at(t), target, target * 0.1_r);
  }
  for (int i = 0; i <= 200; ++i) {
    const Real at = static_cast<Real>(i) / 200;
    if (touches && !(at < t)) break;
    EXPECT_GT(distance_at(at), target * 0.95_r);
  }
}

/// A two-sided triangle, often a sliver, as a mesh.
void expect_first_touch_of_a_triangle(Random* random, const detail::CoreMotion& core) {
  const Vec3 a = random->uniform_in_box({-1, -1, -1}, {1, 1, 1});
  const Vec3 b = random->uniform_in_box({-1, -1, -1}, {1, 1, 1});
  const Real width = random->below(2) == 0 ? 1.0_r : 0.001_r;
  const Vec3 c = a + (b - a) * 0.3_r + test::random_direction(random) * width;
  const TriangleMesh mesh({a, b, c}, {{0, 1, 2}}, true);
  const detail::MeshView view = detail::view_of(mesh);
  Real t = 2;
  sweep_core_to_mesh(core, view, [&](Real at) { return t = std::min(t, at); });
  detail::TriangleInstance triangle;
  ASSERT_TRUE(make_instance(view, 0, {}, core.from, &triangle));
  const detail::CoreMotion relative{{}, core.motion, core.radius, core.error};
  Real expected = 2;
  if (!sweep_core(relative, triangle, &expected)) expected = 2;
  EXPECT_EQ(t, expected);
  expect_first_touch(relative, triangle);
}

TEST(CoreSweep, FindsTheFirstTouchOfEveryShape) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int k = 0; k < 500; ++k) {
    const Vec3 from = random.uniform_in_box({-3, -3, -3}, {3, 3, 3});
    const Vec3 to = random.uniform_in_box({-3, -3, -3}, {3, 3, 3});
    const detail::CoreMotion core{from, to - from, random.uniform(0.05_r, 0.3_r), 1e-5_r};
    expect_first_touch(core, HalfSpace{test::random_direction(&random), -1});
    expect_first_touch(core, Box{random.uniform_in_box({0.1_r, 0.1_r, 0.1_r}, {1, 1, 1})});
    expect_first_touch(core, Capsule{random.uniform(0.1_r, 1), random.uniform(0.1_r, 1)});
    expect_first_touch(core, Cylinder{random.uniform(0.1_r, 1), random.uniform(0.1_r, 1)});
    expect_first_touch(core, Cone{random.uniform(0.1_r, 1), random.uniform(0.1_r, 1)});
    const Hull hull = test::random_hull(&random);
    expect_first_touch(core, detail::instance(hull, {}).shape);
    expect_first_touch_of_a_triangle(&random, core);
  }
}

}  // namespace
}  // namespace jfpx
