// A heap of balls that the processes of mpirun hold together:
//   mpirun -n 4 ./ranks
// It has the same bits with any number of processes.
#include <jfpx/jfpx.hpp>
#include <jfpx/mpi.hpp>

#include <cinttypes>
#include <cstdio>
#include <exception>
#include <memory>

namespace {

jfpx::Scene make_scene() {
  jfpx::Scene scene;
  for (int i = 0; i < 1000; ++i) {
    jfpx::BodyDef ball;
    ball.shape = jfpx::Sphere{jfpx::Real(0.5)};
    ball.mass = 1;
    const auto x = jfpx::Real(i % 10), y = jfpx::Real(i / 100 + 1), z = jfpx::Real(i / 10 % 10);
    ball.position = jfpx::Vec3{x, y, z} * jfpx::Real(1.1);
    ball.position.x += jfpx::Real(i % 7) * jfpx::Real(0.01);
    scene.bodies.push_back(ball);
  }
  jfpx::BodyDef floor;
  floor.shape = jfpx::HalfSpace{{0, 1, 0}, 0};
  floor.mass = 0;
  scene.bodies.push_back(floor);
  return scene;
}

// [simulation]
void simulate() {
  const jfpx::mpi::Session session;
  const auto ranks = std::make_shared<jfpx::mpi::Communicator>();
  jfpx::World world(make_scene(), {.communicator = ranks});
  for (int step = 0; step < 120; ++step) world.step();
  const std::uint64_t hash = world.state_hash();  // all ranks call it
  if (ranks->rank() == 0) {
    std::printf("%u ranks, hash %016" PRIx64 "\n", ranks->size(), hash);
  }
}
// [simulation]

}  // namespace

int main() {
  try {
    simulate();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "ranks: %s\n", error.what());
    return 1;
  }
}
