/// The stages of a Bullet step: stock against jfpx's dispatcher, solver and world, which move
/// identically.
#include <jfpx/bullet/scene_world.hpp>

#include "bench/world/samples.hpp"
#include "src/scenes/scenes.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bench {
namespace {

using bullet::DispatcherKind;
using bullet::SceneWorld;
using bullet::SolverKind;
using bullet::StageTimes;
using bullet::WorldKind;

struct Stage {
  const char* name;
  double StageTimes::*ms;
};
constexpr Stage kStages[] = {
    {"integrate", &StageTimes::integrate}, {"broadphase", &StageTimes::broadphase},
    {"dispatch", &StageTimes::dispatch},   {"islands", &StageTimes::islands},
    {"solve", &StageTimes::solve},         {"step", &StageTimes::total}};

struct Run {
  const char* scene;
  std::uint32_t spheres;
  int settle, steps;
};
constexpr Run kRuns[] = {
    {"pile", 64, 120, 200},    {"pile", 1024, 120, 60},    {"pile", 4096, 120, 31},
    {"pile", 16384, 90, 15},   {"pile", 65536, 60, 7},     {"gas", 64, 30, 200},
    {"gas", 1024, 30, 60},     {"gas", 4096, 30, 31},      {"gas", 16384, 15, 15},
    {"gas", 65536, 10, 7},     {"columns", 64, 30, 200},   {"columns", 1024, 30, 60},
    {"columns", 4096, 30, 31}, {"columns", 16384, 15, 15}, {"columns", 65536, 10, 7},
    {"overlap", 64, 0, 40},    {"overlap", 256, 0, 15},    {"overlap", 1024, 0, 5}};

/// The worlds step in alternating order. The ratio is the median of the ratios of single steps,
/// because consecutive steps have the same noise of the machine.
void steps(benchmark::State& state, const Run& run) {
  Scene scene = scenes::make(run.scene, {.spheres = run.spheres, .seed = 1});
  scene.sleep.enabled = false;
  SceneWorld stock(scene, {.dispatcher = DispatcherKind::stock,
                           .solver = SolverKind::stock,
                           .world = WorldKind::stock});
  SceneWorld ours(scene);
  for (int i = 0; i < run.settle; ++i) {
    stock.step();
    ours.step();
  }
  std::vector<double> stock_ms[std::size(kStages)], ours_ms[std::size(kStages)];
  std::vector<double> ratio[std::size(kStages)];
  bool ours_first = false;
  for (auto _ : state) {
    SceneWorld* order[] = {&stock, &ours};
    if (ours_first) std::swap(order[0], order[1]);
    for (SceneWorld* world : order) world->step();
    ours_first = !ours_first;
    for (std::size_t i = 0; i < std::size(kStages); ++i) {
      const double a = stock.last_step().*kStages[i].ms, b = ours.last_step().*kStages[i].ms;
      stock_ms[i].push_back(a);
      ours_ms[i].push_back(b);
      ratio[i].push_back(a / b);
    }
    state.SetIterationTime(ours.last_step().total * 1e-3);
  }
  if (stock.state_hash() != ours.state_hash()) state.SkipWithError("the worlds differ");
  state.counters["spheres"] = run.spheres;
  for (std::size_t i = 0; i < std::size(kStages); ++i) {
    const std::string name = kStages[i].name;
    state.counters[name + "_stock_ms"] = median(stock_ms[i]);
    state.counters[name + "_jfpx_ms"] = median(ours_ms[i]);
    state.counters[name + "_ratio"] = median(ratio[i]);
  }
}

void register_all() {
  for (const Run& run : kRuns) {
    benchmark::RegisterBenchmark(
        ("bullet_step/" + std::string(run.scene) + "/" + std::to_string(run.spheres)).c_str(),
        [=](benchmark::State& state) { steps(state, run); })
        ->UseManualTime()
        ->Iterations(run.steps)
        ->Unit(benchmark::kMillisecond);
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
