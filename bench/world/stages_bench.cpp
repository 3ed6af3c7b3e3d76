/// Benchmark of the stages of a native step with Solver::worst_first, which are those of the
/// thesis: times and allocations by the number of spheres.
#include <jfpx/world.hpp>

#include "bench/world/floor.hpp"
#include "bench/world/samples.hpp"
#include "src/scenes/scenes.hpp"

#include <atomic>
#include <cstdlib>
#include <new>

namespace {
std::atomic<long> allocations{0};
}

void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace jfpx {
inline namespace JFPX_ABI {
namespace bench {
namespace {

struct Run {
  const char* scene;
  std::uint32_t spheres;
  int settle, steps;
};
constexpr Run kRuns[] = {
    {"gas", 64, 20, 200},           {"gas", 512, 20, 200},         {"gas", 4096, 20, 60},
    {"gas", 32768, 10, 15},         {"gas", 262144, 3, 5},         {"polydisperse", 512, 20, 100},
    {"polydisperse", 4096, 20, 40}, {"polydisperse", 32768, 5, 8}, {"pile", 64, 120, 100},
    {"pile", 512, 60, 40},          {"pile", 4096, 20, 8}};

void stages(benchmark::State& state, Backend backend, const Run& run) {
  Scene scene = scenes::make(run.scene, {.spheres = run.spheres, .seed = 1});
  scene.solver = Solver::worst_first;
  scene.sleep.enabled = false;
  World world(scene, {.collider = {.backend = backend}});
  for (int n = 0; n < run.settle; ++n) world.step();
  std::vector<double> integrate, detect, resolve, contacts, allocated;
  Work integrating, detecting, resolving;
  const auto add = [](Work* sum, const Work& more) {
    sum->bytes += more.bytes;
    sum->operations += more.operations;
  };
  StepReport report;
  for (auto _ : state) {
    const long before = allocations;
    report = world.step();
    allocated.push_back(static_cast<double>(allocations - before));
    integrate.push_back(report.integrate_ms);
    detect.push_back(report.detect_ms);
    resolve.push_back(report.resolve_ms);
    contacts.push_back(static_cast<double>(report.sphere_contacts));
    add(&integrating, integrate_work(report.awake));
    add(&detecting, detect_work(run.spheres, contacts.back()));
    add(&resolving, resolve_work(report, report.awake));
    state.SetIterationTime(report.total_ms * 1e-3);
  }
  state.counters["spheres"] = run.spheres;
  state.counters["contacts"] = mean(contacts);
  state.counters["integrate_ms"] = median(integrate);
  state.counters["detect_ms"] = median(detect);
  state.counters["resolve_ms"] = median(resolve);
  state.counters["allocations"] = median(allocated);
  const auto count = [&](const std::string& stage, const Work& sum) {
    state.counters[stage + "_bytes"] = sum.bytes / static_cast<double>(contacts.size());
    state.counters[stage + "_operations"] = sum.operations / static_cast<double>(contacts.size());
  };
  count("integrate", integrating);
  count("detect", detecting);
  count("resolve", resolving);
  state.SetLabel(std::string(to_string(report.backend)) + ", " +
                 std::string(to_string(report.algorithm)));
}

void register_all() {
  for (const Backend backend : {Backend::cpu, Backend::cuda, Backend::automatic}) {
    if (backend == Backend::cuda && !cuda_is_usable()) continue;
    for (const Run& run : kRuns) {
      benchmark::RegisterBenchmark(
          ("stages/" + std::string(run.scene) + "/" + std::string(to_string(backend)) + "/" +
           std::to_string(run.spheres))
              .c_str(),
          [=](benchmark::State& state) { stages(state, backend, run); })
          ->UseManualTime()
          ->Iterations(run.steps)
          ->Unit(benchmark::kMillisecond);
    }
  }
}

}  // namespace
}  // namespace bench
}  // namespace JFPX_ABI
}  // namespace jfpx

int main(int argc, char** argv) {
  benchmark::AddCustomContext("copied_gb_a_second",
                              std::to_string(jfpx::bench::copied_gb_a_second()));
  benchmark::AddCustomContext("giga_operations_a_second",
                              std::to_string(jfpx::bench::giga_operations_a_second()));
  jfpx::bench::register_all();
  return jfpx::bench::run_benchmarks(argc, argv);
}
