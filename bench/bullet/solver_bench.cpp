/// Whole steps and their parts: a stock Bullet world against one with jfpx's dispatcher, solver and
/// world.
///
/// Each benchmark owns two worlds that move identically and steps both in alternating order. Parts
/// are Bullet's profile zones. With one thread the clock is the CPU time of that thread, which
/// other work on the machine disturbs little; with more it is the wall clock. Counters are medians;
/// a ratio is the median of stock / jfpx, so larger than 1 means that jfpx is faster.
#include <jfpx/bullet/scene_world.hpp>

#include "examples/scenes/scenes.hpp"

#include <LinearMath/btQuickprof.h>
#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <ctime>
#include <string>
#include <vector>

namespace jfpx::inline JFPX_ABI::bullet {
namespace {

clockid_t g_clock = CLOCK_MONOTONIC;

double now_ms() {
  timespec t{};
  clock_gettime(g_clock, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

/// Zones that are timed, and the part that each is counted for, or taken away from.
enum Part : std::size_t { kMotion, kBoxes, kDispatch, kIslands, kSetUp, kSweeps, kFinish, kParts };
constexpr const char* kPartNames[kParts] = {"motion", "boxes",  "dispatch", "islands",
                                            "set_up", "sweeps", "finish"};
struct Zone {
  const char* name;
  Part part;
  double sign;
};
constexpr Zone kZones[] = {{"predictUnconstraintMotion", kMotion, 1},
                           {"createPredictiveContacts", kMotion, 1},
                           {"integrateTransforms", kMotion, 1},
                           {"updateActivationState", kMotion, 1},
                           {"updateAabbs", kBoxes, 1},
                           {"calculateOverlappingPairs", kBoxes, 1},
                           {"dispatchAllCollisionPairs", kDispatch, 1},
                           {"calculateSimulationIslands", kIslands, 1},
                           {"solveConstraints", kIslands, 1},
                           {"solveGroup", kIslands, -1},
                           {"solveGroupCacheFriendlySetup", kSetUp, 1},
                           {"solveGroupCacheFriendlyIterations", kSweeps, 1},
                           {"solveGroupCacheFriendlyFinish", kFinish, 1}};

std::array<double, kParts> g_parts;
std::vector<std::pair<const Zone*, double>> g_open;

void enter_zone(const char* name) {
  const Zone* zone = std::find_if(std::begin(kZones), std::end(kZones),
                                  [&](const Zone& z) { return std::strcmp(z.name, name) == 0; });
  g_open.emplace_back(zone == std::end(kZones) ? nullptr : zone, now_ms());
}
void leave_zone() {
  const auto [zone, since] = g_open.back();
  g_open.pop_back();
  if (zone != nullptr) g_parts[zone->part] += zone->sign * (now_ms() - since);
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

struct Samples {
  std::vector<double> total;
  std::array<std::vector<double>, kParts> parts;

  void step(SceneWorld& world) {
    g_parts = {};
    const double start = now_ms();
    world.step();
    total.push_back(now_ms() - start);
    for (std::size_t i = 0; i < kParts; ++i) parts[i].push_back(g_parts[i]);
  }
  void report(benchmark::State& state, const std::string& who) const {
    state.counters["step_" + who + "_ms"] = median(total);
    for (std::size_t i = 0; i < kParts; ++i) {
      state.counters[std::string(kPartNames[i]) + "_" + who + "_ms"] = median(parts[i]);
    }
  }
};

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
  btSetCustomEnterProfileZoneFunc(enter_zone);
  btSetCustomLeaveProfileZoneFunc(leave_zone);
  Samples stock_samples, our_samples;
  bool swap = false;
  for (auto _ : state) {
    if (swap) our_samples.step(ours);
    stock_samples.step(stock);
    if (!swap) our_samples.step(ours);
    swap = !swap;
    state.SetIterationTime(our_samples.total.back() * 1e-3);
  }
  btSetCustomEnterProfileZoneFunc([](const char*) {});
  btSetCustomLeaveProfileZoneFunc([] {});
  if (stock.state_hash() != ours.state_hash()) state.SkipWithError("the worlds differ");
  stock_samples.report(state, "stock");
  our_samples.report(state, "jfpx");
  std::vector<double> ratios;
  for (std::size_t i = 0; i < stock_samples.total.size(); ++i) {
    ratios.push_back(stock_samples.total[i] / our_samples.total[i]);
  }
  state.counters["ratio"] = median(ratios);
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
}  // namespace jfpx::inline JFPX_ABI::bullet

int main(int argc, char** argv) {
  jfpx::bullet::register_all();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
