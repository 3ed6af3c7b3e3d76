/// Compares whole steps and their parts between a stock Bullet world and a world with jfpx's
/// dispatcher, solver and world.
///
/// Each benchmark owns two worlds with identical motion and steps both in alternating order. Parts
/// are Bullet's profile zones. With one thread the clock is the CPU time of that thread, which
/// other load affects little; with more threads it is the wall clock. Counters are medians. A ratio
/// is the median of stock / jfpx, so a value above 1 means that jfpx is faster.
#include "bench/bullet/step_parts.hpp"
#include "src/scenes/scenes.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

void compare_steps(benchmark::State& state, const char* name, std::uint32_t spheres, int settle,
                   unsigned threads) {
  Scene scene = scenes::make(name, {.spheres = spheres, .seed = 1});
  scene.sleep.enabled = false;
  SceneWorldOptions options;
  options.dispatch.collider.threads = options.solve.threads = options.step.threads = threads;
  SceneWorld ours(scene, options);
  SceneWorld stock(scene, {.dispatcher = DispatcherKind::stock,
                           .solver = SolverKind::stock,
                           .world = WorldKind::stock});
  for (int i = 0; i < settle; ++i) {
    stock.step();
    ours.step();
  }
  g_clock = threads == 1 ? CLOCK_THREAD_CPUTIME_ID : CLOCK_MONOTONIC;
  step_in_turn(state, stock, ours);
  const ConstraintSolverStats& stats = ours.jfpx_solver()->stats();
  state.counters["groups"] = static_cast<double>(stats.groups);
  state.counters["contacts"] = static_cast<double>(stats.contacts) /
                               static_cast<double>(std::max<std::uint64_t>(stats.groups, 1));
}

struct Case {
  const char* scene;
  std::uint32_t spheres;
  int settle, samples;
};
constexpr Case kCases[] = {
    {"pile", 16, 300, 400},  {"pile", 64, 300, 300},  {"pile", 256, 300, 200},
    {"pile", 1024, 200, 60}, {"pile", 4096, 120, 30}, {"pile", 16384, 60, 11},
    {"pile", 65536, 30, 5},  {"gas", 16, 300, 400},   {"gas", 64, 300, 300},
    {"gas", 256, 300, 200},  {"gas", 1024, 200, 60},  {"gas", 4096, 120, 30},
    {"gas", 16384, 60, 11},  {"gas", 65536, 30, 5},   {"columns", 16384, 60, 11},
};

void register_all() {
  for (const Case& c : kCases) {
    for (const unsigned threads : {1u, 2u, 8u}) {
      const std::string name = std::string("step/") + c.scene + "/" + std::to_string(c.spheres) +
                               "/threads:" + std::to_string(threads);
      benchmark::RegisterBenchmark(name.c_str(),
                                   [c, threads](benchmark::State& state) {
                                     compare_steps(state, c.scene, c.spheres, c.settle, threads);
                                   })
          ->UseManualTime()
          ->Iterations(c.samples)
          ->Unit(benchmark::kMillisecond);
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
