/// Example of a character that a game controls: it pushes a crate, climbs stairs, rides a lift and
/// jumps down. A turn back in time repeats the same bits.
#include <jfpx/character.hpp>

#include <cstdio>

namespace {

using jfpx::Real;

jfpx::BodyDef box(const jfpx::Vec3& half_extents, const jfpx::Vec3& position, Real mass) {
  jfpx::BodyDef def;
  def.shape = jfpx::Box{half_extents};
  def.position = position;
  def.mass = mass;
  return def;
}

/// A step of the game: the world first, then the character.
void step(jfpx::World& world, const jfpx::CharacterSettings& settings, jfpx::CharacterState& player,
          Real speed, bool jump) {
  const Real dt = world.settings().dt;
  world.step();
  player.velocity.x = speed;             // the direction that the user wants
  player.velocity.y -= Real(9.81) * dt;  // gravity; has no effect on the ground
  const bool stands = player.ground_state == jfpx::GroundState::ground;
  if (jump && stands) player.velocity.y = 5;

  const jfpx::CharacterMove move = jfpx::move_character(world, settings, player, dt);
  player = move.state;
  for (const jfpx::CharacterHit& hit : move.hits) {  // an inelastic hit by a body of 20 kg
    const auto mass = world.mass(hit.body);
    const auto impulse = hit.approach_speed * 20 * mass / (20 + mass);  // 0 for a mass of 0
    world.apply_impulse_at_point(hit.body, hit.normal * -impulse, hit.point);
  }
}

void print(const char* what, const jfpx::CharacterState& player) {
  std::printf("%s: x = %.1f m, y = %.1f m, %s\n", what, static_cast<double>(player.position.x),
              static_cast<double>(player.position.y),
              player.ground_state == jfpx::GroundState::ground ? "stands" : "falls");
}

}  // namespace

int main() {
  jfpx::Scene scene;
  scene.bodies.push_back(box({30, 1, 10}, {0, -1, 0}, 0));
  for (int n = 0; n < 4; ++n) {  // steps of 25 cm
    const Real height = Real(0.25) * static_cast<Real>(n + 1);
    scene.bodies.push_back(box({2 - height, height / 2, 2}, {6 + height, height / 2, 0}, 0));
  }
  jfpx::BodyDef platform = box({1, Real(0.1), 2}, {9, Real(0.9), 0}, 0);
  platform.kinematic = true;
  scene.bodies.push_back(platform);
  jfpx::World world(scene);
  const jfpx::BodyId lift = world.bodies().back();
  const jfpx::BodyId crate =
      world.add(box({Real(0.3), Real(0.3), Real(0.3)}, {2, Real(0.3), 0}, 10));

  jfpx::CharacterSettings settings;  // a capsule, 1.8 m high
  settings.step_height = Real(0.3);
  jfpx::CharacterState player;
  player.position = {0, 1, 0};
  for (int n = 0; n < 30; ++n) step(world, settings, player, 2, false);
  print("after half a second", player);
  for (int n = 0; n < 30; ++n) step(world, settings, player, 2, false);
  std::printf("the crate was pushed by %.1f m\n",
              static_cast<double>(world.state(crate).position.x - 2));
  world.remove(crate);

  while (player.position.x < 9) step(world, settings, player, 3, false);
  print("on the lift", player);
  jfpx::BodyState ride = world.state(lift);
  ride.velocity = {0, 1, 0};
  world.set_state(lift, ride);

  // Both states are values, so the game can turn back.
  const jfpx::Snapshot snapshot = world.snapshot();
  const jfpx::CharacterState saved = player;
  for (int n = 0; n < 60; ++n) step(world, settings, player, 0, false);
  print("after a ride of a second", player);
  const jfpx::CharacterState first = player;
  world.restore(snapshot);
  player = saved;
  for (int n = 0; n < 60; ++n) step(world, settings, player, 0, false);
  std::printf("the second ride %s the same bits\n", player == first ? "has" : "does not have");

  step(world, settings, player, 3, true);
  for (int n = 0; n < 90; ++n) step(world, settings, player, 3, false);
  print("after the jump", player);
}
