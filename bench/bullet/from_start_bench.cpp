/// Steps of scenes from the start, and of one that has settled, and removals of bodies: a stock
/// Bullet world against one with all parts of jfpx, on all threads and with a GPU if there is one.
/// Wall clock; means over all steps, by part of the step.
///
/// Both worlds step alternately and end with the same state hash.
#include "bench/bullet/ragdolls.hpp"
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
  int settle = 0;  ///< steps before the first
};
constexpr Case kCases[] = {{"pile", 200, {}, 7, 200},      {"pile", 1024, {}, 7, 200},
                           {"mixed", 1500, 1500, 77, 240}, {"pile", 16384, {}, 991, 200},
                           {"pile", 65536, {}, 3, 90},     {"gas", 65536, {}, 5, 60},
                           {"pile", 65536, {}, 3, 30, 600}};
constexpr int kRagdolls = 500, kRagdollSteps = 240;
constexpr std::uint32_t kRemovalSpheres = 16384;
constexpr int kRemovals = 1000;

SceneWorldOptions our_options(unsigned threads) {
  SceneWorldOptions options;
  options.dispatch.collider.threads = options.solve.threads = options.step.threads = threads;
  return options;
}

double sum(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

/// Steps both worlds, and reports means and the ratio of the sums.
template <class World>
void compare(benchmark::State& state, World& stock, World& ours) {
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

/// The scene with the bodies as they are after some steps.
Scene settled(Scene scene, int steps, unsigned threads) {
  SceneWorld world(scene, our_options(threads));
  for (int i = 0; i < steps; ++i) world.step();
  const std::vector<BodyState> states = world.states();
  for (std::size_t i = 0; i < states.size(); ++i) {
    BodyDef& body = scene.bodies[i];
    body.position = states[i].position;
    body.orientation = states[i].orientation;
    body.velocity = states[i].velocity;
    body.angular_velocity = states[i].angular_velocity;
  }
  return scene;
}

void compare_scene(benchmark::State& state, const Case& c, unsigned threads) {
  Scene scene = scenes::make(c.scene, {.spheres = c.spheres, .boxes = c.boxes, .seed = c.seed});
  scene.sleep.enabled = false;
  if (c.settle > 0) scene = settled(std::move(scene), c.settle, threads);
  SceneWorld stock(scene, {.dispatcher = DispatcherKind::stock,
                           .solver = SolverKind::stock,
                           .world = WorldKind::stock});
  SceneWorld ours(scene, our_options(threads));
  for (int i = 0; c.settle > 0 && i < 10; ++i) {  // the first step of a world is longer
    stock.step();
    ours.step();
  }
  compare(state, stock, ours);
}

void compare_ragdolls(benchmark::State& state, unsigned threads) {
  RagdollWorld stock(kRagdolls, 0), ours(kRagdolls, threads);
  compare(state, stock, ours);
  state.counters["manifolds"] = ours.world().getDispatcher()->getNumManifolds();
}

/// Removes one body of a falling pile after the other.
void compare_removals(benchmark::State& state, unsigned threads) {
  Scene scene = scenes::make("pile", {.spheres = kRemovalSpheres, .seed = 991});
  scene.sleep.enabled = false;
  SceneWorld stock(scene, {.dispatcher = DispatcherKind::stock,
                           .solver = SolverKind::stock,
                           .world = WorldKind::stock});
  SceneWorld ours(scene, our_options(threads));
  const auto step_both = [&] {
    stock.step();
    ours.step();
  };
  for (int i = 0; i < 30; ++i) step_both();
  state.counters["pairs"] = ours.world().getPairCache()->getNumOverlappingPairs();
  const auto remove_last = [](btDiscreteDynamicsWorld& world) {
    const double start = now_ms();
    world.removeRigidBody(
        btRigidBody::upcast(world.getCollisionObjectArray()[world.getNumCollisionObjects() - 1]));
    return now_ms() - start;
  };
  double stock_ms = 0, our_ms = 0;
  for (auto _ : state) {
    stock_ms += remove_last(stock.world());
    const double taken = remove_last(ours.world());
    our_ms += taken;
    state.SetIterationTime(taken * 1e-3);
  }
  state.counters["ratio"] = stock_ms / our_ms;
  state.counters["removal_stock_us"] = 1e3 * stock_ms / kRemovals;
  state.counters["removal_jfpx_us"] = 1e3 * our_ms / kRemovals;
  step_both();
  if (stock.state_hash() != ours.state_hash()) state.SkipWithError("the worlds differ");
}

template <class Run>
void add(const std::string& name, int steps, const Run& run) {
  const unsigned cores = std::max(1u, std::thread::hardware_concurrency());
  for (const unsigned threads : {1u, cores}) {
    benchmark::RegisterBenchmark(
        ("from_start/" + name + "/threads:" + std::to_string(threads)).c_str(),
        [run, threads](benchmark::State& state) { run(state, threads); })
        ->UseManualTime()
        ->Iterations(steps)
        ->Unit(benchmark::kMillisecond);
    if (cores == 1) break;
  }
}

void register_all() {
  for (const Case& c : kCases) {
    add(std::string(c.scene) + (c.settle > 0 ? "_settled/" : "/") + std::to_string(c.spheres),
        c.steps,
        [&c](benchmark::State& state, unsigned threads) { compare_scene(state, c, threads); });
  }
  add("ragdolls/" + std::to_string(kRagdolls), kRagdollSteps, compare_ragdolls);
  add("removal/" + std::to_string(kRemovalSpheres), kRemovals, compare_removals);
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx

int main(int argc, char** argv) {
  return jfpx::bullet::run_benchmarks(argc, argv, jfpx::bullet::register_all);
}
