/// Scene mixed: balls and boxes of many sizes fall into a pit of half-spaces.
#include "src/scenes/makers.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace scenes {
namespace {

BodyDef half_space(const Vec3& normal, Real offset) {
  BodyDef def;
  def.shape = HalfSpace{normal, offset};
  def.mass = 0;
  return def;
}

}  // namespace

// Bodies start on a lattice that separates all of them. Balls and boxes alternate until one kind is
// used up. The pit is a floor with four walls that lean outwards with a slope of 3 to 4.
Scene make_mixed(const Counts& counts) {
  constexpr Real kSpacing = Real(1.8);  // the longest diagonal of a box is 1.74
  Scene scene;
  scene.name = "mixed";
  Random random(counts.seed);
  const std::uint64_t bodies = std::uint64_t{counts.spheres} + counts.boxes;
  std::uint32_t side = 1;
  while (std::uint64_t{side} * side * side < 2 * bodies) ++side;  // the height is half the width
  std::uint32_t spheres = counts.spheres, boxes = counts.boxes;
  const Real width = static_cast<Real>(side - 1) * kSpacing;
  for (std::uint64_t i = 0; i < bodies; ++i) {
    BodyDef body;
    const bool is_sphere = boxes == 0 || (spheres > 0 && i % 2 == 0);
    if (is_sphere) {
      --spheres;
      const Real radius = random.uniform(Real(0.25), Real(0.6));
      body.shape = Sphere{radius};
      body.mass = 8 * radius * radius * radius;
    } else {
      --boxes;
      const Vec3 half = random.uniform_in_box({Real(0.2), Real(0.2), Real(0.2)},
                                              {Real(0.5), Real(0.5), Real(0.5)});
      body.shape = Box{half};
      body.mass = 8 * half.x * half.y * half.z;
      body.orientation = random_orientation(random);
    }
    body.position = lattice_site(static_cast<std::uint32_t>(i), side) * kSpacing +
                    Vec3{width * Real(-0.5), 1, width * Real(-0.5)};
    body.linear_damping = Real(0.99);
    body.angular_damping = Real(0.8);
    scene.bodies.push_back(body);
  }
  const Real half_width = width * Real(0.5) + 1;
  scene.bodies.push_back(half_space({0, 1, 0}, 0));
  for (const Vec3& inwards : {Vec3{1, 0, 0}, Vec3{-1, 0, 0}, Vec3{0, 0, 1}, Vec3{0, 0, -1}}) {
    const Vec3 normal = inwards * Real(0.8) + Vec3{0, Real(0.6), 0};
    scene.bodies.push_back(half_space(normal, dot(normal, inwards * -half_width)));
  }
  return scene;
}

}  // namespace scenes
}  // namespace JFPX_ABI
}  // namespace jfpx
