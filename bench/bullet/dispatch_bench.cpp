/// dispatchAllCollisionPairs and whole steps: Bullet's dispatcher against ours, on the same state.
///
/// Each benchmark owns two worlds that move identically. A sample steps both one after the other in
/// alternating order and measures the wall clock of the dispatch in the step ("cold", because the
/// other stages have evicted its data from the caches), then repeats the dispatch alone ("hot").
/// Counters are medians; a ratio is stock / jfpx, so jfpx is faster if it is larger than 1.
#include <jfpx/bullet/scene_world.hpp>

#include "bench/bullet/series.hpp"
#include "src/scenes/scenes.hpp"

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <thread>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

double dispatch_ms(SceneWorld& w, int repeats) {
  btDispatcher& dispatcher = w.dispatcher();
  btOverlappingPairCache* pairs = w.world().getPairCache();
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < repeats; ++i) {
    dispatcher.dispatchAllCollisionPairs(pairs, w.world().getDispatchInfo(), &dispatcher);
  }
  const std::chrono::duration<double, std::milli> taken = std::chrono::steady_clock::now() - start;
  return taken.count() / repeats;
}

void compare_dispatch(benchmark::State& state, const char* name, std::uint32_t spheres, int settle,
                      SceneWorldOptions options = {}) {
  Scene scene = scenes::make(name, {.spheres = spheres, .seed = 1});
  scene.sleep.enabled = false;
  options.solver = SolverKind::stock;  // see solver_bench.cpp
  options.world = WorldKind::stock;
  SceneWorld ours(scene, options);
  options.dispatcher = DispatcherKind::stock;
  SceneWorld stock(scene, options);
  for (int i = 0; i < settle; ++i) {
    stock.step();
    ours.step();
  }
  const int repeats = static_cast<int>(std::max(1u, 4096u / spheres));
  Series cold, hot, step;
  bool swap = false;
  for (auto _ : state) {
    alternate(
        swap, [&] { stock.step(); }, [&] { ours.step(); });
    cold.add(stock.last_step().dispatch, ours.last_step().dispatch);
    step.add(stock.last_step().total, ours.last_step().total);
    double stock_ms = 0, ours_ms = 0;
    alternate(
        swap, [&] { stock_ms = dispatch_ms(stock, repeats); },
        [&] { ours_ms = dispatch_ms(ours, repeats); });
    hot.add(stock_ms, ours_ms);
    state.SetIterationTime(ours.last_step().dispatch * 1e-3);
    swap = !swap;
  }
  if (stock.state_hash() != ours.state_hash()) state.SkipWithError("the worlds differ");
  cold.report(state, "dispatch");
  hot.report(state, "hot");
  step.report(state, "step");
  const DispatchStats& stats = ours.jfpx_dispatcher()->stats();
  state.counters["pairs"] = ours.world().getPairCache()->getNumOverlappingPairs();
  const auto per_batch = [&](std::uint64_t count) {
    return stats.batches == 0 ? 0 : static_cast<double>(count) / static_cast<double>(stats.batches);
  };
  state.counters["touching"] = per_batch(stats.touching);
  state.counters["to_device"] = per_batch(stats.to_device);
  state.counters["from_device"] = per_batch(stats.from_device);
}

/// A gas of random spheres at rest with three contacts per sphere, as in the collider benchmark:
/// Bullet's dispatch, and the collider alone, which also finds the pairs.
void random_gas(benchmark::State& state, std::uint32_t spheres) {
  const std::vector<SphereInstance> instances = scenes::random_spheres(spheres, 3, 1);
  const std::unique_ptr<SphereCollider> collider = make_sphere_collider();
  Scene scene;
  for (const SphereInstance& sphere : instances) {
    BodyDef body;
    body.shape = Sphere{sphere.radius};
    body.position = sphere.centre;
    body.acceleration = {};
    scene.bodies.push_back(body);
  }
  SceneWorld ours(scene);
  SceneWorld stock(scene, {.dispatcher = DispatcherKind::stock});
  for (SceneWorld* world : {&ours, &stock}) world->world().performDiscreteCollisionDetection();
  Series series, search;
  bool swap = false;
  for (auto _ : state) {
    double stock_ms = 0, ours_ms = 0;
    alternate(
        swap, [&] { stock_ms = dispatch_ms(stock, 1); }, [&] { ours_ms = dispatch_ms(ours, 1); });
    series.add(stock_ms, ours_ms);
    const auto start = std::chrono::steady_clock::now();
    benchmark::DoNotOptimize(collider->find_contacts(instances).data());
    const std::chrono::duration<double, std::milli> found =
        std::chrono::steady_clock::now() - start;
    search.add(stock_ms, found.count());
    state.SetIterationTime(ours_ms * 1e-3);
    swap = !swap;
  }
  series.report(state, "dispatch");
  search.report(state, "find_contacts");
  state.counters["pairs"] = ours.world().getPairCache()->getNumOverlappingPairs();
}

struct Size {
  std::uint32_t spheres;
  int settle, samples;
};
constexpr Size kSizes[] = {{16, 300, 400},  {64, 300, 300},   {256, 300, 200}, {1024, 200, 100},
                           {4096, 120, 40}, {16384, 120, 11}, {65536, 120, 7}};

void register_dispatch(const std::string& name, const char* scene, const Size& size,
                       const SphereColliderOptions& collider) {
  SceneWorldOptions options;
  options.dispatch.collider = collider;
  benchmark::RegisterBenchmark((name + "/" + scene + "/" + std::to_string(size.spheres)).c_str(),
                               [=](benchmark::State& state) {
                                 compare_dispatch(state, scene, size.spheres, size.settle, options);
                               })
      ->UseManualTime()
      ->Iterations(size.samples)
      ->Unit(benchmark::kMillisecond);
}

bool cuda_is_usable() {
  const auto backends = available_backends();
  return std::any_of(backends.begin(), backends.end(), [](const BackendStatus& status) {
    return status.backend == Backend::cuda && status.usable;
  });
}

void register_all() {
  const bool with_cuda = cuda_is_usable();
  for (const char* scene : {"pile", "gas"}) {
    for (const Size& size : kSizes) {
      register_dispatch("dispatch", scene, size, {.backend = Backend::cpu});
      for (const unsigned threads : {2u, 4u}) {
        if (size.spheres < 4096 || threads > std::thread::hardware_concurrency()) continue;
        register_dispatch("dispatch_threads_" + std::to_string(threads), scene, size,
                          {.backend = Backend::cpu, .threads = threads});
      }
      if (with_cuda && size.spheres >= 1024) {
        register_dispatch("dispatch_cuda", scene, size, {.backend = Backend::cuda});
      }
    }
  }
  benchmark::RegisterBenchmark("dispatch/random_gas/100000",
                               [](benchmark::State& state) { random_gas(state, 100000); })
      ->UseManualTime()
      ->Iterations(9)
      ->Unit(benchmark::kMillisecond);
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx

int main(int argc, char** argv) {
  return jfpx::bullet::run_benchmarks(argc, argv, jfpx::bullet::register_all);
}
