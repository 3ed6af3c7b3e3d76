/// A stranger's program with the solver and the particles of the thesis.
#include <jfpx/thesis/particle.hpp>
#include <jfpx/thesis/worst_first.hpp>

#include <cstdio>

int main() {
  jfpx::thesis::enable();
  jfpx::Scene scene;
  scene.solver = jfpx::Solver::worst_first;
  scene.bodies = {{.shape = jfpx::Sphere{1}}, {.shape = jfpx::Sphere{1}, .position = {1, 0, 0}}};
  jfpx::World world(scene);
  jfpx::ParticleWorld particles;
  particles.add({});
  particles.step();
  std::printf("a step of worst_first: %d contact, %d particle\n",
              static_cast<int>(world.step().contacts),
              static_cast<int>(particles.particles().size()));
}
