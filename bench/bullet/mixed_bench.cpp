/// The native world against stock Bullet with its defaults: the same scene, step by step in turns,
/// one thread each.
#include <jfpx/bullet/scene_world.hpp>
#include <jfpx/random.hpp>
#include <jfpx/world.hpp>

#include <benchmark/benchmark.h>

#include <chrono>
#include <cmath>

namespace jfpx {
namespace {

double now_ms() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double, std::milli>(now).count();
}

/// Spheres and boxes in turns, in layers above the ground: a heap that falls together.
Scene heap(std::uint32_t bodies) {
  Random random(1);
  Scene scene;
  const auto side = static_cast<std::uint32_t>(std::ceil(std::sqrt(bodies / 10.0)));
  for (std::uint32_t i = 0; i < bodies; ++i) {
    BodyDef def;
    if (i % 2 == 0) def.shape = Sphere{random.uniform(Real(0.3), Real(0.5))};
    if (i % 2 == 1) {
      const Real least = Real(0.25), most = Real(0.45);
      def.shape = Box{random.uniform_in_box({least, least, least}, {most, most, most})};
    }
    const auto x = static_cast<Real>(i % side), z = static_cast<Real>(i / side % side);
    const auto y = static_cast<Real>(i / (side * side));
    const Vec3 jitter = random.uniform_in_box({-1, -1, -1}, {1, 1, 1}) * Real(0.1);
    def.position = Vec3{x, y + Real(0.7), z} * Real(1.1) + jitter;
    scene.bodies.push_back(def);
  }
  BodyDef ground;
  ground.shape = HalfSpace{};
  ground.mass = 0;
  scene.bodies.push_back(ground);
  return scene;
}

/// Steps `first` to `first` + iterations. The ratio is Bullet's time to ours: above 1, ours wins.
void step_both(benchmark::State& state) {
  const Scene scene = heap(static_cast<std::uint32_t>(state.range(0)));
  World native(scene);
  bullet::SceneWorld stock(scene, {.dispatcher = bullet::DispatcherKind::stock});
  for (std::int64_t n = 0; n < state.range(1); ++n) {
    native.step();
    stock.step();
  }
  double native_ms = 0, stock_ms = 0;
  StepReport sum;
  for (auto _ : state) {
    const double start = now_ms();
    const StepReport report = native.step();
    const double between = now_ms();
    stock.step();
    native_ms += between - start;
    stock_ms += now_ms() - between;
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
    ->Iterations(100)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace jfpx

BENCHMARK_MAIN();
