/// Benchmark of figures 5.1 to 5.3 of the thesis: contact detection per frame of boxes-and-balls.
#include <jfpx/world.hpp>

#include "bench/world/samples.hpp"
#include "src/scenes/scenes.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bench {
namespace {

struct Size {
  std::uint32_t spheres;
  int frames;  ///< about 1000 in the thesis; fewer where a frame takes long
};
constexpr Size kSizes[] = {{2, 1000},   {4, 1000},   {8, 1000},   {16, 1000},   {32, 1000},
                           {64, 1000},  {128, 1000}, {256, 1000}, {448, 1000},  {1024, 400},
                           {4096, 200}, {16384, 50}, {65536, 20}, {262144, 10}, {1000000, 5}};

/// The whole detection of a frame: spheres with each other and with the ground. The first frame is
/// reported separately, because it allocates buffers and, on a GPU, starts the device.
void frames(benchmark::State& state, Backend backend, const Size& size) {
  World world(scenes::make("boxes-and-balls", {.spheres = size.spheres, .seed = 1}),
              {.collider = {.backend = backend}});
  const double first_ms = world.step().detect_ms;
  std::vector<double> ms;
  double contacts = 0;
  for (auto _ : state) {
    const StepReport report = world.step();
    ms.push_back(report.detect_ms);
    contacts += static_cast<double>(report.contacts);
    state.SetIterationTime(report.detect_ms * 1e-3);
  }
  state.counters["spheres"] = size.spheres;
  state.counters["first_ms"] = first_ms;
  state.counters["median_ms"] = median(ms);
  state.counters["contacts"] = contacts / static_cast<double>(ms.size());
}

void register_all() {
  for (const Backend backend : {Backend::cpu, Backend::cuda, Backend::automatic}) {
    if (backend == Backend::cuda && !cuda_is_usable()) continue;
    for (const Size& size : kSizes) {
      benchmark::RegisterBenchmark(
          ("thesis/" + std::string(to_string(backend)) + "/" + std::to_string(size.spheres))
              .c_str(),
          [=](benchmark::State& state) { frames(state, backend, size); })
          ->UseManualTime()
          ->Iterations(size.frames)
          ->Unit(benchmark::kMillisecond);
    }
  }
}

}  // namespace
}  // namespace bench
}  // namespace JFPX_ABI
}  // namespace jfpx

int main(int argc, char** argv) {
  jfpx::bench::register_all();
  return jfpx::bench::run_benchmarks(argc, argv);
}
