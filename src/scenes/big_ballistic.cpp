/// Scene big-ballistic: two crates on the ground, and an optional volley of rounds.
#include "src/scenes/makers.hpp"
#include "src/scenes/weapons.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace scenes {
namespace {

// Material of Millington's demo, on which the original is based. The original's friction of 0.01
// was an error (E44).
void set_demo_material(BodyDef* body) {
  body->friction = Real(0.9);
  body->restitution = Real(0.1);
}

/// The numbers of the original, except the position: the original's crates start inside the ground
/// and inside each other (E44); these crates stand on the ground, face to face.
BodyDef crate(Real z) {
  BodyDef def;
  def.shape = Box{{2, 2, 2}};
  def.mass = 8;
  def.position = {0, 2, z};
  def.linear_damping = Real(0.95);
  def.angular_damping = Real(0.99);
  set_demo_material(&def);
  return def;
}

}  // namespace

BodyDef big_round(Weapon weapon) {
  struct Numbers {
    Real mass, radius;
    Vec3 velocity, acceleration;
    Real damping;
  };
  static constexpr Numbers kNumbers[] = {
      {Real(1.5), Real(0.2), {0, 0, 20}, {0, Real(-0.5), 0}, Real(0.99)},
      {200, Real(0.4), {0, 30, 40}, {0, -21, 0}, Real(0.99)},
      {4, Real(0.6), {0, Real(-0.5), 10}, {0, Real(0.3), 0}, Real(0.9)},
      {Real(0.1), Real(0.2), {0, 0, 100}, {}, Real(0.99)}};
  const Numbers& numbers = kNumbers[static_cast<std::size_t>(weapon)];
  BodyDef round = sphere_at(kBigGun, numbers.radius, numbers.mass);
  round.velocity = numbers.velocity;
  round.acceleration = numbers.acceleration;
  round.linear_damping = numbers.damping;
  round.angular_damping = Real(0.8);
  round.can_sleep = false;
  set_demo_material(&round);
  return round;
}

// The volley starts on a vertical grid with four columns, one per weapon.
Scene make_big_ballistic(const Counts& counts) {
  Scene scene;
  scene.name = "big-ballistic";
  scene.solver = Solver::worst_first;
  scene.bodies = {crate(50), crate(54)};
  BodyDef ground;
  ground.shape = HalfSpace{{0, 1, 0}, 0};
  ground.mass = 0;
  set_demo_material(&ground);
  scene.bodies.push_back(ground);
  for (std::uint32_t i = 0; i < counts.spheres; ++i) {
    const std::uint32_t column = i % 4, storey = i / 4;
    BodyDef round = big_round(static_cast<Weapon>(column));
    round.position += Vec3{static_cast<Real>(column) * Real(1.3) - Real(1.95),
                           static_cast<Real>(storey) * Real(1.3), 0};
    scene.bodies.push_back(round);
  }
  return scene;
}

}  // namespace scenes
}  // namespace JFPX_ABI
}  // namespace jfpx
