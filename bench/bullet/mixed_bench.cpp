/// Compares the native world with stock Bullet and its defaults: the same scene, with alternating
/// steps of one thread each.
#include <jfpx/bullet/scene_world.hpp>
#include <jfpx/world.hpp>

#include "src/scenes/scenes.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <ctime>
#include <vector>

namespace jfpx {
namespace {

/// CPU time of this thread, because on a busy machine the wall clock includes other processes.
double now_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Times steps from `from_step` on. A ratio is stock / native, so a value above 1 means that the
/// native world is faster: `ratio` of the total times, `median_ratio` the median over the steps.
void step_both(benchmark::State& state) {
  const auto half = static_cast<std::uint32_t>(state.range(0) / 2);
  const Scene scene = scenes::make("mixed", {.spheres = half, .boxes = half});
  World native(scene);
  bullet::SceneWorld stock(scene, {.dispatcher = bullet::DispatcherKind::stock,
                                   .solver = bullet::SolverKind::stock,
                                   .world = bullet::WorldKind::stock});
  for (std::int64_t n = 0; n < state.range(1); ++n) {
    native.step();
    stock.step();
  }
  double native_ms = 0, stock_ms = 0;
  std::vector<double> ratios;
  StepReport sum;
  for (auto _ : state) {
    const double start = now_ms();
    const StepReport report = native.step();
    const double between = now_ms();
    stock.step();
    const double end = now_ms();
    native_ms += between - start;
    stock_ms += end - between;
    ratios.push_back((end - between) / (between - start));
    sum.contacts += report.contacts;
    sum.awake += report.awake;
    sum.integrate_ms += report.integrate_ms;
    sum.detect_ms += report.detect_ms;
    sum.resolve_ms += report.resolve_ms;
    sum.position_iterations += report.position_iterations;
    sum.velocity_iterations += report.velocity_iterations;
  }
  const auto mean = [&](auto total) {
    return benchmark::Counter(static_cast<double>(total), benchmark::Counter::kAvgIterations);
  };
  state.counters["ratio"] = stock_ms / native_ms;
  state.counters["median_ratio"] = median(ratios);
  state.counters["native_ms"] = mean(native_ms);
  state.counters["stock_ms"] = mean(stock_ms);
  state.counters["integrate_ms"] = mean(sum.integrate_ms);
  state.counters["detect_ms"] = mean(sum.detect_ms);
  state.counters["resolve_ms"] = mean(sum.resolve_ms);
  state.counters["contacts"] = mean(sum.contacts);
  state.counters["awake"] = mean(sum.awake);
  state.counters["position_iterations"] = mean(sum.position_iterations);
  state.counters["velocity_iterations"] = mean(sum.velocity_iterations);
}

BENCHMARK(step_both)
    ->ArgNames({"bodies", "from_step"})
    ->Args({2000, 0})
    ->Args({2000, 100})
    ->Args({2000, 300})
    ->Args({2000, 600})
    ->Iterations(100)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace jfpx

BENCHMARK_MAIN();
