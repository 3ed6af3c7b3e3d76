/// Lattice sites, bodies and containers of the named scenes.
#include "src/scenes/makers.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace scenes {

std::uint32_t cube_side(std::uint32_t n) {
  std::uint64_t side = 1;
  while (side * side * side < n) ++side;
  return static_cast<std::uint32_t>(side);
}

Vec3 lattice_site(std::uint32_t i, std::uint32_t side) {
  const std::uint64_t layer = std::uint64_t{side} * side;
  const std::uint64_t in_layer = i % layer, storey = i / layer, row = in_layer / side;
  return {static_cast<Real>(in_layer % side), static_cast<Real>(storey), static_cast<Real>(row)};
}

/// A point of the four-dimensional unit ball, normalised.
Quat random_orientation(Random& random) {
  for (;;) {
    const Quat q{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1),
                 random.uniform(-1, 1)};
    const Real n2 = length_squared(q);
    if (n2 > Real(0.01) && n2 < 1) return normalized(q);
  }
}

BodyDef sphere_at(const Vec3& position, Real radius, Real mass) {
  BodyDef body;
  body.shape = Sphere{radius};
  body.mass = mass;
  body.position = position;
  return body;
}

BodyDef box_at(const Vec3& position, const Vec3& half_extents, Real mass) {
  BodyDef body;
  body.shape = Box{half_extents};
  body.mass = mass;
  body.position = position;
  return body;
}

void add_ground(Scene& scene) {
  BodyDef ground;
  ground.shape = HalfSpace{{0, 1, 0}, 0};
  ground.mass = 0;
  scene.bodies.push_back(ground);
}

void add_balls(Scene& scene, std::uint32_t count, const Vec3& target) {
  constexpr Real kBallRadius = Real(0.3), kSpeed = 20;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Real time = static_cast<Real>(i + 1);
    BodyDef ball = sphere_at(target - Vec3{0, 0, kSpeed * time + kBallRadius}, kBallRadius, 50);
    ball.velocity = {0, ball.acceleration.y * time * Real(-0.5), kSpeed};
    scene.bodies.push_back(ball);
  }
}

void add_container(Scene& scene, const Vec3& lower, const Vec3& upper, bool closed,
                   const BodyDef& material) {
  constexpr Real kThickness = 2;
  const Vec3 centre = (lower + upper) * Real(0.5);
  const Vec3 half = (upper - lower) * Real(0.5);
  for (int axis = 0; axis < 3; ++axis) {
    for (const Real side : {Real(-1), Real(1)}) {
      const bool lid = axis == 1 && side > 0;
      if (lid && !closed) continue;
      BodyDef wall = material;
      wall.mass = 0;
      Box box{half + Vec3{kThickness, kThickness, kThickness}};
      box.half_extents[axis] = kThickness * Real(0.5);
      wall.shape = box;
      wall.position = centre;
      wall.position[axis] += side * (half[axis] + kThickness * Real(0.5));
      scene.bodies.push_back(wall);
    }
  }
}

}  // namespace scenes
}  // namespace JFPX_ABI
}  // namespace jfpx
