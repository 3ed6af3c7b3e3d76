/// Benchmarks of native steps, of rays, and of the resolver of Solver::worst_first.
#include <jfpx/random.hpp>

#include "src/scenes/scenes.hpp"
#include "src/thesis/contact_resolver.hpp"

#include <benchmark/benchmark.h>

namespace jfpx {
namespace {

/// One step of a scene after `warm_up` steps; the counters have the times of the stages.
void step(benchmark::State& state, const char* name, std::uint32_t spheres, int warm_up) {
  World world(scenes::make(name, {.spheres = spheres, .seed = 1}));
  for (int n = 0; n < warm_up; ++n) world.step();
  StepReport sum;
  for (auto _ : state) {
    const StepReport report = world.step();
    sum.contacts += report.contacts;
    sum.position_iterations += report.position_iterations;
    sum.velocity_iterations += report.velocity_iterations;
    sum.integrate_ms += report.integrate_ms;
    sum.detect_ms += report.detect_ms;
    sum.resolve_ms += report.resolve_ms;
  }
  const auto mean = [&](auto total) {
    return benchmark::Counter(static_cast<double>(total), benchmark::Counter::kAvgIterations);
  };
  state.counters["contacts"] = mean(sum.contacts);
  state.counters["position_iterations"] = mean(sum.position_iterations);
  state.counters["velocity_iterations"] = mean(sum.velocity_iterations);
  state.counters["integrate_ms"] = mean(sum.integrate_ms);
  state.counters["detect_ms"] = mean(sum.detect_ms);
  state.counters["resolve_ms"] = mean(sum.resolve_ms);
}

void step_pile_2048(benchmark::State& state) { step(state, "pile", 2048, 120); }
void step_tower_448(benchmark::State& state) { step(state, "boxes-and-balls", 448, 400); }

/// One ray into a pile, by the number of spheres.
void cast_ray(benchmark::State& state) {
  const World world(
      scenes::make("pile", {.spheres = static_cast<std::uint32_t>(state.range(0)), .seed = 1}));
  Random random(1);
  for (auto _ : state) {
    const Ray ray{{0, 1000, 0}, random.uniform_in_box({-1, -50, -1}, {1, -50, 1})};
    benchmark::DoNotOptimize(world.cast_ray(ray));
  }
  state.counters["time_per_body"] = benchmark::Counter(
      static_cast<double>(state.range(0)),
      benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

/// A lattice with 19494 contacts and random velocities.
struct DenseLattice {
  DenseLattice() : bodies(Real(0.01), SleepSettings{}) {
    Scene scene = scenes::make("lattice", {.spheres = 19 * 19 * 19, .seed = 1});
    World still(scene);
    still.step();
    contacts.assign(still.contacts().begin(), still.contacts().end());
    Random random(1);
    for (BodyDef& def : scene.bodies) {
      def.velocity = random.uniform_in_box({-5, -5, -5}, {5, 5, 5});
      bodies.add(def);
    }
  }
  BodyStore bodies;
  std::vector<Contact> contacts;
};

void resolve_20000(benchmark::State& state) {
  const DenseLattice lattice;
  ContactResolver resolver;
  const ResolverSettings settings{.max_iterations = static_cast<std::uint32_t>(state.range(0))};
  std::uint64_t iterations = 0;
  for (auto _ : state) {
    state.PauseTiming();
    BodyStore bodies = lattice.bodies;
    state.ResumeTiming();
    const ResolverReport report = resolver.resolve(bodies, lattice.contacts, settings);
    iterations += report.position_iterations + report.velocity_iterations;
  }
  state.counters["contacts"] = static_cast<double>(lattice.contacts.size());
  state.counters["iterations"] =
      benchmark::Counter(static_cast<double>(iterations), benchmark::Counter::kAvgIterations);
  state.counters["time_per_iteration"] = benchmark::Counter(
      static_cast<double>(iterations), benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

BENCHMARK(step_pile_2048)->Unit(benchmark::kMillisecond);
BENCHMARK(step_tower_448)->Unit(benchmark::kMillisecond);
BENCHMARK(cast_ray)->Arg(1000)->Arg(10000)->Arg(100000);
BENCHMARK(resolve_20000)->Arg(20000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace jfpx

BENCHMARK_MAIN();
