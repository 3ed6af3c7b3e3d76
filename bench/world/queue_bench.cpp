/// Benchmark of steps on a GPU with and without a wait of the host in each step.
#include <jfpx/backend.hpp>
#include <jfpx/cuda/world.hpp>
#include <jfpx/world.hpp>

#include "src/base/cuda/cuda_try.hpp"
#include "src/base/cuda/device_buffer.hpp"
#include "src/scenes/scenes.hpp"

#include <benchmark/benchmark.h>

#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bench {
namespace {

constexpr std::uint32_t kSteps = 100;  // in an iteration

/// A graph of one step.
class StepGraph {
 public:
  explicit StepGraph(World* world) : stream_(cuda::device_states(*world).device) {
    cudaGraph_t captured = nullptr;
    JFPX_CUDA_TRY(cudaStreamBeginCapture(stream_.get(), cudaStreamCaptureModeGlobal));
    cuda::enqueue_steps(*world, 1, stream_.get());
    JFPX_CUDA_TRY(cudaStreamEndCapture(stream_.get(), &captured));
    JFPX_CUDA_TRY(cudaGraphInstantiate(&graph_, captured, 0));
    JFPX_CUDA_TRY(cudaGraphDestroy(captured));
  }
  ~StepGraph() { static_cast<void>(cudaGraphExecDestroy(graph_)); }
  StepGraph(const StepGraph&) = delete;
  StepGraph& operator=(const StepGraph&) = delete;
  void launch() const { JFPX_CUDA_TRY(cudaGraphLaunch(graph_, stream_.get())); }

 private:
  cuda::OwnedStream stream_;
  cudaGraphExec_t graph_ = nullptr;
};

enum class Way { step, enqueue, graph };

/// Steps of a pile that lies and is kept awake.
void make_steps(benchmark::State& state, Way way, std::uint32_t spheres) {
  for (const BackendStatus& status : available_backends()) {
    if (status.backend == Backend::cuda && !status.usable) {
      return state.SkipWithError("the backend is not usable");
    }
  }
  Scene scene = scenes::make("pile", {.spheres = spheres});
  for (BodyDef& def : scene.bodies) def.can_sleep = false;
  World world(scene, {.collider = {.backend = Backend::cuda}});
  for (int n = 0; n < 400; ++n) world.step();
  const std::uint64_t version = cuda::device_states(world).version;
  const StepGraph graph(&world);
  for (auto _ : state) {
    if (way == Way::enqueue) cuda::enqueue_steps(world, kSteps, nullptr);
    for (std::uint32_t n = 0; n < kSteps && way != Way::enqueue; ++n) {
      if (way == Way::step) world.step();
      if (way == Way::graph) graph.launch();
    }
    cuda::finish_steps(world);
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * kSteps));
  state.counters["contacts"] = static_cast<double>(world.step().contacts);
  state.counters["moved"] = cuda::device_states(world).version == version ? 0 : 1;
}

void register_all() {
  for (const std::uint32_t spheres : {448u, 10'000u, 100'000u}) {
    for (const auto& [way, name] :
         {std::pair(Way::step, "step"), {Way::enqueue, "enqueue"}, {Way::graph, "graph"}}) {
      benchmark::RegisterBenchmark(
          ("100_steps/" + std::string(name) + "/pile:" + std::to_string(spheres)).c_str(),
          [way = way, spheres](benchmark::State& state) { make_steps(state, way, spheres); })
          ->Iterations(5)
          ->Unit(benchmark::kMillisecond)
          ->UseRealTime();
    }
  }
}

}  // namespace
}  // namespace bench
}  // namespace JFPX_ABI
}  // namespace jfpx

int main(int argc, char** argv) {
  jfpx::bench::register_all();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
