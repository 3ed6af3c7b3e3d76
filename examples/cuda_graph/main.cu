/// A CUDA graph of two steps of a world and a kernel that reads the states after them: the height
/// of a collapsing pile over time. The host waits once for 30 launches.
#include <jfpx/cuda/world.hpp>
#include <jfpx/error.hpp>
#include <jfpx/random.hpp>

#include <cuda_runtime.h>

#include <cstdio>
#include <cstdlib>

namespace {

using jfpx::Real;

constexpr unsigned kThreads = 256, kRounds = 8, kLaunches = 30;

void check(cudaError_t error) {
  if (error == cudaSuccess) return;
  std::fprintf(stderr, "cuda_graph: %s\n", cudaGetErrorString(error));
  std::exit(1);
}

/// Heights of the pile, in memory that both the device and the host address.
struct Record {
  unsigned count = 0;
  unsigned millimetres[kLaunches] = {};
};

/// Runs in one block.
__global__ void record_height(jfpx::cuda::DeviceStates states, Record* record) {
  if (*states.deferred_steps != 0) return;  // the host will make these steps
  __shared__ unsigned highest;
  if (threadIdx.x == 0) highest = 0;
  __syncthreads();
  for (std::size_t k = threadIdx.x; k < states.count; k += kThreads) {
    const Real height = states.positions[states.ids[k].index].y;
    if (height > 0) atomicMax(&highest, static_cast<unsigned>(height * 1000));
  }
  __syncthreads();
  if (threadIdx.x == 0) record->millimetres[record->count++] = highest;
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
  world.step();
  cudaStream_t stream;
  check(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));
  Record* record = nullptr;
  check(cudaMallocManaged(&record, sizeof *record));
  cudaGraphExec_t launchable = nullptr;
  std::uint64_t version = 0;
  for (unsigned round = 0; round < kRounds; ++round) {
    const jfpx::cuda::DeviceStates states = jfpx::cuda::device_states(world);
    if (launchable == nullptr || version != states.version) {
      cudaGraph_t graph;
      check(cudaStreamBeginCapture(stream, cudaStreamCaptureModeGlobal));
      jfpx::cuda::enqueue_steps(world, 2, stream);
      record_height<<<1, kThreads, 0, stream>>>(states, record);
      check(cudaGetLastError());
      check(cudaStreamEndCapture(stream, &graph));
      if (launchable != nullptr) check(cudaGraphExecDestroy(launchable));
      check(cudaGraphInstantiate(&launchable, graph, 0));
      check(cudaGraphDestroy(graph));
      version = states.version;
    }
    *record = {};
    for (unsigned n = 0; n < kLaunches; ++n) check(cudaGraphLaunch(launchable, stream));
    const jfpx::StepReport report = jfpx::cuda::finish_steps(world);
    check(cudaStreamSynchronize(stream));
    const unsigned last = record->count == 0 ? 0 : record->millimetres[record->count - 1];
    std::printf("step %3llu: %6llu contacts, %2u heights from the graph, the last %.3f m\n",
                static_cast<unsigned long long>(report.step),
                static_cast<unsigned long long>(report.contacts), record->count, last / 1000.0);
  }
  check(cudaGraphExecDestroy(launchable));
  check(cudaFree(record));
  check(cudaStreamDestroy(stream));
}

}  // namespace

int main() {
  try {
    run();
  } catch (const jfpx::BackendUnavailable& e) {
    std::fprintf(stderr, "cuda_graph: %s\n", e.what());
    return 3;
  } catch (const jfpx::Error& e) {
    std::fprintf(stderr, "cuda_graph: %s\n", e.what());
    return 1;
  }
}
