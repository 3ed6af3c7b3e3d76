/// Benchmarks of worlds in motion: the search for touching pairs of moving spheres, and bodies that
/// come and go.
#include <jfpx/backend.hpp>
#include <jfpx/random.hpp>
#include <jfpx/world.hpp>

#include "bench/sphere_collider/inputs.hpp"
#include "src/scenes/scenes.hpp"
#include "src/world/contacts/neighbor_list.hpp"

#include <benchmark/benchmark.h>

#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bench {
namespace {

/// 100,000 spheres with three contacts each. Every search follows a motion along straight lines.
class MovingGas {
 public:
  /// @param speed largest motion per search along each axis, as part of the radius
  explicit MovingGas(Real speed) : spheres_(input("gas").make(100'000)) {
    Random random(1);
    for (const SphereInstance& s : spheres_) {
      velocities_.push_back(random.uniform_in_box({-1, -1, -1}, {1, 1, 1}) * (speed * s.radius));
    }
  }
  void move() {
    for (std::size_t i = 0; i < spheres_.size(); ++i) spheres_[i].centre += velocities_[i];
  }
  std::span<const SphereInstance> spheres() const { return spheres_; }

 private:
  std::vector<SphereInstance> spheres_;
  std::vector<Vec3> velocities_;
};

/// `keeps`: with the neighbor list that steps of a world use; otherwise, every search is new.
void search(benchmark::State& state, Real speed, bool keeps) {
  MovingGas gas(speed);
  const auto collider = make_sphere_collider({.backend = Backend::cpu});
  NeighborList list;
  std::size_t pairs = 0;
  for (auto _ : state) {
    gas.move();
    if (!keeps) {
      pairs = collider->find_pairs(gas.spheres()).size();
      continue;
    }
    const NeighborPairs found = list.find(gas.spheres(), collider.get(), nullptr);
    pairs = 0;
    found.for_each_touching(gas.spheres(), 0, found.pairs.size(),
                            [&pairs](std::span<const SpherePair> part) { pairs += part.size(); });
  }
  state.counters["pairs"] = static_cast<double>(pairs);
}

/// Removes bodies of a heap between two steps.
void remove_bodies(benchmark::State& state, std::uint32_t spheres) {
  constexpr std::size_t kRemoved = 100;
  Scene scene = scenes::make("pile", {.spheres = spheres});
  World world(scene);
  for (int n = 0; n < 100; ++n) world.step();
  for (auto _ : state) {
    state.PauseTiming();
    World other(scene);
    other.restore(world.snapshot());
    const std::vector<BodyId> ids(other.bodies().begin(), other.bodies().begin() + kRemoved);
    state.ResumeTiming();
    for (const BodyId id : ids) other.remove(id);
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * kRemoved));
}

/// A step of a pile in which `count` balls come and as many go.
void come_and_go(benchmark::State& state, Backend backend, std::uint32_t spheres,
                 std::size_t count) {
  for (const BackendStatus& status : available_backends()) {
    if (status.backend == backend && !status.usable) {
      return state.SkipWithError("the backend is not usable");
    }
  }
  const Scene scene = scenes::make("pile", {.spheres = spheres});
  World world(scene, {.collider = {.backend = backend}, .threads = 0});
  for (int n = 0; n < 60; ++n) world.step();
  Random random(1);
  // Ids in the order of removal; the sorted list of all ids would be made anew for each step.
  std::vector<BodyId> balls;
  for (const BodyId id : world.bodies()) {
    if (std::holds_alternative<Sphere>(world.shape(id))) balls.push_back(id);
  }
  for (auto _ : state) {
    for (std::size_t k = 0; k < count; ++k) {
      BodyId& ball = balls[random.below(balls.size())];
      world.remove(ball);
      ball = world.add(scene.bodies[random.below(spheres)]);
    }
    world.step();
  }
  state.counters["contacts"] = static_cast<double>(world.step().contacts);
}

void register_all() {
  for (const double speed : {0.001, 0.01, 0.03, 0.1}) {
    for (const bool keeps : {false, true}) {
      const std::string name = std::string(keeps ? "neighbor_list" : "new_search") +
                               "/speed:" + std::to_string(speed).substr(0, 5);
      benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) {
        search(state, static_cast<Real>(speed), keeps);
      })->Iterations(40);
    }
  }
  for (const std::uint32_t spheres : {1000u, 10'000u, 100'000u}) {
    benchmark::RegisterBenchmark(("remove_100/pile:" + std::to_string(spheres)).c_str(),
                                 [=](benchmark::State& state) { remove_bodies(state, spheres); })
        ->Iterations(5);
  }
  for (const Backend backend : {Backend::cpu, Backend::cuda}) {
    for (const std::uint32_t spheres : {10'000u, 100'000u, 1'000'000u}) {
      for (const std::size_t count : {0u, 1u, 1000u}) {
        const std::string name = "come_and_go/" + std::string(to_string(backend)) +
                                 "/pile:" + std::to_string(spheres) +
                                 "/count:" + std::to_string(count);
        benchmark::RegisterBenchmark(
            name.c_str(),
            [=](benchmark::State& state) { come_and_go(state, backend, spheres, count); })
            ->Iterations(20)
            ->Unit(benchmark::kMillisecond)
            ->UseRealTime();
      }
    }
  }
}

}  // namespace
}  // namespace bench
}  // namespace JFPX_ABI
}  // namespace jfpx

int main(int argc, char** argv) {
  jfpx::bench::register_all();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
