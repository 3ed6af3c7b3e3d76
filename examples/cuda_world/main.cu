/// A world on the GPU, and a kernel that reads its states there: how high the balls of a pile lie.
/// The states are not copied to the host.
#include <jfpx/cuda/world.hpp>
#include <jfpx/error.hpp>
#include <jfpx/random.hpp>

#include <cuda_runtime.h>

#include <cstdio>
#include <cstdlib>

namespace {

using jfpx::Real;

constexpr int kLayers = 8;  // of 2 m

void check(cudaError_t error) {
  if (error == cudaSuccess) return;
  std::fprintf(stderr, "cuda_world: %s\n", cudaGetErrorString(error));
  std::exit(1);
}

__global__ void count_by_height(jfpx::cuda::DeviceStates states, unsigned* counts) {
  const std::size_t k = blockIdx.x * std::size_t{blockDim.x} + threadIdx.x;
  if (k >= states.count) return;
  const Real height = states.positions[states.ids[k].index].y;
  const int layer = height < 0 ? 0 : static_cast<int>(height / 2);
  atomicAdd(&counts[layer < kLayers ? layer : kLayers - 1], 1u);
}

jfpx::Scene pile(int balls) {
  jfpx::Scene scene;
  jfpx::Random random(1);
  for (int i = 0; i < balls; ++i) {
    jfpx::BodyDef def;
    def.shape = jfpx::Sphere{Real(0.5)};
    def.position = random.uniform_in_box({-8, 1, -8}, {8, 31, 8});
    scene.bodies.push_back(def);
  }
  jfpx::BodyDef floor;
  floor.shape = jfpx::HalfSpace{{0, 1, 0}, 0};
  floor.mass = 0;
  scene.bodies.push_back(floor);
  return scene;
}

void run() {
  jfpx::World world(pile(5000), {.collider = {.backend = jfpx::Backend::cuda}});
  unsigned* counts = nullptr;  // memory that both the device and the host address
  check(cudaMallocManaged(&counts, kLayers * sizeof *counts));
  for (int n = 0; n <= 120; ++n) {
    world.step();
    if (n % 40 != 0) continue;
    const jfpx::cuda::DeviceStates states = jfpx::cuda::device_states(world);
    check(cudaMemsetAsync(counts, 0, kLayers * sizeof *counts, states.stream));
    const auto blocks = static_cast<unsigned>((states.count + 255) / 256);
    count_by_height<<<blocks, 256, 0, states.stream>>>(states, counts);
    check(cudaGetLastError());
    check(cudaStreamSynchronize(states.stream));
    std::printf("step %3d, bodies by height:", n);
    for (int layer = 0; layer < kLayers; ++layer) std::printf(" %u", counts[layer]);
    std::printf("\n");
  }
  check(cudaFree(counts));
}

}  // namespace

int main() {
  try {
    run();
  } catch (const jfpx::BackendUnavailable& e) {
    std::fprintf(stderr, "cuda_world: %s\n", e.what());
    return 3;
  } catch (const jfpx::Error& e) {
    std::fprintf(stderr, "cuda_world: %s\n", e.what());
    return 1;
  }
}
