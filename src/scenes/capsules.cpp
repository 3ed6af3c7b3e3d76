/// Scene capsules: balls, boxes, capsules and crosses of two capsules fall onto the ground.
#include "src/scenes/makers.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace scenes {
namespace {

Capsule random_capsule(Random& random) {
  const Real radius = random.uniform(Real(0.1), Real(0.25));
  return {radius, random.uniform(Real(0.1), Real(0.5))};
}

/// Two capsules at a right angle.
Compound cross(const Capsule& capsule) {
  constexpr Real kHalfRoot2 = Real(0.70710678118654752440);
  return {{{.shape = capsule}, {.shape = capsule, .orientation = {kHalfRoot2, kHalfRoot2, 0, 0}}}};
}

}  // namespace

/// One half of the bodies are balls and boxes, the other half alternates between capsules and
/// crosses. They start on a lattice that separates all of them.
Scene make_capsules(const Counts& counts) {
  constexpr Real kSpacing = Real(1.8);
  Scene scene;
  scene.name = "capsules";
  Random random(counts.seed);
  const std::uint64_t bodies = 2 * (std::uint64_t{counts.spheres} + counts.boxes);
  std::uint32_t side = 1;
  while (std::uint64_t{side} * side * side < bodies) ++side;
  std::uint32_t spheres = counts.spheres, boxes = counts.boxes;
  const Real width = static_cast<Real>(side - 1) * kSpacing;
  add_ground(scene);
  for (std::uint64_t i = 0; i < bodies; ++i) {
    BodyDef body;
    if (i % 4 == 1) {
      body.shape = random_capsule(random);
    } else if (i % 4 == 3) {
      body.shape = cross(random_capsule(random));
    } else if (boxes == 0 || (spheres > 0 && i % 4 == 0)) {
      --spheres;
      body.shape = Sphere{random.uniform(Real(0.15), Real(0.3))};
    } else {
      --boxes;
      body.shape = Box{random.uniform_in_box({Real(0.15), Real(0.15), Real(0.15)},
                                             {Real(0.4), Real(0.4), Real(0.4)})};
    }
    body.orientation = random_orientation(random);
    body.position = lattice_site(static_cast<std::uint32_t>(i), side) * kSpacing +
                    Vec3{width * Real(-0.5), 1, width * Real(-0.5)};
    body.rolling_friction = Real(0.002);
    scene.bodies.push_back(body);
  }
  return scene;
}

}  // namespace scenes
}  // namespace JFPX_ABI
}  // namespace jfpx
