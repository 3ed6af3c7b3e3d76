/// A pile of balls whose state lies on the GPU, and the same pile on the CPU: both have the same
/// bits after every step.
#include <jfpx/random.hpp>
#include <jfpx/world.hpp>

#include <cstdio>

namespace {

using jfpx::Real;

jfpx::Scene pile(int balls) {
  jfpx::Scene scene;
  jfpx::Random random(1);
  for (int i = 0; i < balls; ++i) {
    jfpx::BodyDef def;
    def.shape = jfpx::Sphere{Real(0.5)};
    def.position = random.uniform_in_box({-4, 1, -4}, {4, 41, 4});
    scene.bodies.push_back(def);
  }
  jfpx::BodyDef floor;
  floor.shape = jfpx::HalfSpace{{0, 1, 0}, 0};
  floor.mass = 0;
  scene.bodies.push_back(floor);
  return scene;
}

}  // namespace

int main() try {
  const jfpx::Scene scene = pile(1000);
  jfpx::World world(scene, {.collider = {.backend = jfpx::Backend::cuda}});
  jfpx::World reference(scene, {.collider = {.backend = jfpx::Backend::cpu}});
  for (int n = 0; n < 120; ++n) {
    world.step();
    reference.step();
    if (world.state_hash() != reference.state_hash()) {
      std::printf("step %d differs\n", n);
      return 1;
    }
  }
  std::printf("120 steps with the same bits, %zu contacts\n", world.contacts().size());
} catch (const jfpx::BackendUnavailable& error) {
  std::printf("%s\n", error.what());
}
