/// Long run of the scene `mixed`: balls and boxes in a pit stay inside and finite, and gain no
/// energy.
#include "src/scenes/scenes.hpp"
#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace jfpx {
namespace {

JFPX_SOLVER_SUITE(Mixed);

/// Kinetic and potential energy of the movable bodies, in double.
double energy(const World& world) {
  const std::vector<BodyState> states = world.states();
  const std::vector<BodyDef> bodies = test::definitions(world);
  double sum = 0;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const BodyDef& def = bodies[i];
    if (!(def.mass > 0)) continue;
    const Vec3 spin =
        transform_transpose(to_matrix(states[i].orientation), states[i].angular_velocity);
    const auto* box = std::get_if<Box>(&def.shape);
    const Vec3 moments = box != nullptr
                             ? detail::moments_of_inertia(*box, def.mass)
                             : detail::moments_of_inertia(std::get<Sphere>(def.shape), def.mass);
    sum += static_cast<double>(def.mass * length_squared(states[i].velocity) / 2 +
                               dot(component_product(moments, spin), spin) / 2 -
                               def.mass * dot(def.acceleration, states[i].position));
  }
  return sum;
}

/// Smallest distance of a body's centre from a wall that it touches: its smallest extent.
Real extent(const Shape& shape) {
  if (const auto* box = std::get_if<Box>(&shape)) {
    return std::min({box->half_extents.x, box->half_extents.y, box->half_extents.z});
  }
  return std::get<Sphere>(shape).radius;
}

/// The largest penetration of a wall, as a fraction of the body's smallest extent.
Real worst_intrusion(const World& world) {
  const std::vector<BodyState> states = world.states();
  const std::vector<BodyDef> bodies = test::definitions(world);
  Real worst = 0;
  for (const BodyDef& wall : bodies) {
    const auto* solid = std::get_if<HalfSpace>(&wall.shape);
    if (solid == nullptr) continue;
    for (std::size_t i = 0; i < states.size(); ++i) {
      const BodyDef& def = bodies[i];
      if (!(def.mass > 0)) continue;
      const Real height = dot(solid->normal, states[i].position) - solid->offset;
      worst = std::max(worst, 1 - height / extent(def.shape));
    }
  }
  return worst;
}

TEST_P(Mixed, StaysFiniteInItsPitAndGainsNoEnergyForTenThousandSteps) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Scene scene = scenes::make("mixed", {.spheres = 12, .boxes = 12, .seed = seed});
  scene.solver = GetParam();
  scene.sleep.enabled = false;  // sleep would end the test after two hundred steps
  World world(scene);
  const double start = energy(world);
  double least = start, gain = 0;
  Real intrusion = 0;
  for (int n = 0; n < 10000; ++n) {
    ASSERT_FALSE(world.step().non_finite) << "step " << n;
    const double now = energy(world);
    least = std::min(least, now);
    gain = std::max(gain, now - least);
    intrusion = std::max(intrusion, worst_intrusion(world));
  }
  // Projection lifts the bodies that it separates, by centimetres at most.
  if (GetParam() == Solver::worst_first) {
    EXPECT_LT(gain, 2e-3 * start);
  }
  EXPECT_LT(intrusion, 0.75) << "1 would be a centre that has gone through";
  EXPECT_LT(energy(world), start);
}

}  // namespace
}  // namespace jfpx
