/// Steps of scenes from the start: a stock Bullet world against one with all parts of jfpx, on all
/// threads and with a GPU if there is one. Wall clock; sums over all steps, by part of the step.
///
/// Both worlds step alternately and end with the same state hash.
#include "bench/bullet/step_parts.hpp"
#include "src/scenes/scenes.hpp"

#include <numeric>
#include <optional>
#include <thread>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

struct Case {
  const char* scene;
  std::uint32_t spheres;
  std::optional<std::uint32_t> boxes;
  std::uint32_t seed;
  int steps;
};
constexpr Case kCases[] = {{"pile", 200, {}, 7, 200},      {"pile", 1024, {}, 7, 200},
                           {"mixed", 1500, 1500, 77, 240}, {"pile", 16384, {}, 991, 200},
                           {"pile", 65536, {}, 3, 90},     {"gas", 65536, {}, 5, 60}};

SceneWorldOptions our_options(unsigned threads) {
  SceneWorldOptions options;
  options.dispatch.collider.threads = options.solve.threads = options.step.threads = threads;
  return options;
}

double sum(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

void compare(benchmark::State& state, const Case& c, unsigned threads) {
  Scene scene = scenes::make(c.scene, {.spheres = c.spheres, .boxes = c.boxes, .seed = c.seed});
  scene.sleep.enabled = false;
  SceneWorld stock(scene, {.dispatcher = DispatcherKind::stock,
                           .solver = SolverKind::stock,
                           .world = WorldKind::stock});
  SceneWorld ours(scene, our_options(threads));
  Samples stock_samples, our_samples;
  sample_in_turn(state, stock, ours, &stock_samples, &our_samples);
  const auto steps = static_cast<double>(stock_samples.total.size());
  const double stock_total = sum(stock_samples.total), our_total = sum(our_samples.total);
  state.counters["ratio"] = stock_total / our_total;
  state.counters["step_stock_ms"] = stock_total / steps;
  state.counters["step_jfpx_ms"] = our_total / steps;
  for (std::size_t i = 0; i < kBodies; ++i) {
    const std::string name = kPartNames[i];
    state.counters[name + "_stock_ms"] = sum(stock_samples.parts[i]) / steps;
    state.counters[name + "_jfpx_ms"] = sum(our_samples.parts[i]) / steps;
  }
}

void register_all() {
  const unsigned cores = std::max(1u, std::thread::hardware_concurrency());
  for (const Case& c : kCases) {
    for (const unsigned threads : {1u, cores}) {
      const std::string name = std::string("from_start/") + c.scene + "/" +
                               std::to_string(c.spheres) + "/threads:" + std::to_string(threads);
      benchmark::RegisterBenchmark(
          name.c_str(), [&c, threads](benchmark::State& state) { compare(state, c, threads); })
          ->UseManualTime()
          ->Iterations(c.steps)
          ->Unit(benchmark::kMillisecond);
      if (cores == 1) break;
    }
  }
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx

int main(int argc, char** argv) {
  return jfpx::bullet::run_benchmarks(argc, argv, jfpx::bullet::register_all);
}
