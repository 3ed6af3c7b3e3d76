/// Whole steps of a settled scene: a stock Bullet world against one of jfpx on one thread, on all
/// threads, with a GPU, or with automatic choice.
///
/// Both worlds start with the same bodies, which a world of jfpx has moved until they have settled
/// (or which are read from --settled=FOLDER), step alternately, and end with the same state hash.
/// No third world competes for the caches. Wall clock; a ratio is the median of stock / jfpx.
#include "bench/bullet/step_parts.hpp"
#include "src/scenes/scenes.hpp"

#include <cstdio>
#include <fstream>
#include <thread>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

std::string g_folder;  ///< folder of settled states; empty: they are not stored
bool g_only_settle = false;

struct Case {
  const char* scene;
  std::uint32_t spheres;
  int settle, samples;
};
constexpr Case kCases[] = {
    {"pile", 16, 300, 200},  {"pile", 64, 300, 200},    {"pile", 255, 300, 100},
    {"pile", 1024, 300, 60}, {"pile", 4096, 300, 61},   {"pile", 16384, 300, 21},
    {"pile", 65536, 300, 5}, {"gas", 255, 60, 100},     {"gas", 16384, 60, 11},
    {"gas", 65536, 60, 5},   {"columns", 16384, 60, 11}};

struct Rival {
  const char* name;
  Backend backend;
  unsigned threads;  ///< at most; 0: one per core
};
/// If there is a GPU, the dispatcher may choose it, too; the solver of "cuda" must use it.
constexpr Rival kRivals[] = {{"cpu_1", Backend::cpu, 1}, {"auto_1", Backend::automatic, 1},
                             {"cpu", Backend::cpu, 0},   {"cuda_8", Backend::cuda, 8},
                             {"cuda", Backend::cuda, 0}, {"auto", Backend::automatic, 0}};

SceneWorldOptions options_of(const Rival& rival) {
  SceneWorldOptions options;
  options.dispatch.collider.backend =
      rival.backend == Backend::cpu ? Backend::cpu : Backend::automatic;
  options.solve.backend = rival.backend;
  const unsigned cores = std::max(1u, std::thread::hardware_concurrency());
  const unsigned threads = rival.threads == 0 ? cores : std::min(cores, rival.threads);
  options.dispatch.collider.threads = options.solve.threads = options.step.threads = threads;
  return options;
}

Scene settled(const Case& c) {
  Scene scene = scenes::make(c.scene, {.spheres = c.spheres, .seed = 1});
  scene.sleep.enabled = false;
  const std::string file = g_folder + "/" + c.scene + "_" + std::to_string(c.spheres) + ".states";
  std::vector<BodyState> states(scene.bodies.size());
  const auto bytes = static_cast<std::streamsize>(states.size() * sizeof(BodyState));
  std::ifstream in(file, std::ios::binary);
  if (g_folder.empty() || !in.read(reinterpret_cast<char*>(states.data()), bytes)) {
    SceneWorld world(scene, options_of(kRivals[2]));
    for (int i = 0; i < c.settle; ++i) world.step();
    states = world.states();
    if (!g_folder.empty()) {
      std::ofstream(file, std::ios::binary)
          .write(reinterpret_cast<const char*>(states.data()), bytes);
    }
  }
  for (std::size_t i = 0; i < states.size(); ++i) {
    scene.bodies[i].position = states[i].position;
    scene.bodies[i].orientation = states[i].orientation;
    scene.bodies[i].velocity = states[i].velocity;
    scene.bodies[i].angular_velocity = states[i].angular_velocity;
  }
  return scene;
}

bool has_cuda() {
  for (const BackendStatus& status : available_backends()) {
    if (status.backend == Backend::cuda) return status.usable;
  }
  return false;
}

void compare(benchmark::State& state, const Case& c, const Rival& rival) {
  const Scene scene = settled(c);
  if (g_only_settle) {
    for (auto _ : state) state.SetIterationTime(1e-9);
    return;
  }
  SceneWorld stock(scene, {.dispatcher = DispatcherKind::stock,
                           .solver = SolverKind::stock,
                           .world = WorldKind::stock});
  SceneWorld ours(scene, options_of(rival));
  const int warm_up = 12;  // until the buffers have grown
  for (int i = 0; i < warm_up; ++i) {
    stock.step();
    ours.step();
  }
  step_in_turn(state, stock, ours);
  const ConstraintSolverStats& stats = ours.jfpx_solver()->stats();
  const auto steps = static_cast<double>(warm_up) + static_cast<double>(state.iterations());
  state.counters["groups"] = static_cast<double>(stats.groups) / steps;
  state.counters["on_device"] = static_cast<double>(stats.on_device) / steps;
  state.counters["contacts"] = static_cast<double>(stats.contacts) / steps;
}

void register_all() {
  for (const Case& c : kCases) {
    for (const Rival& rival : kRivals) {
      if (rival.backend == Backend::cuda && !has_cuda()) continue;
      const std::string name =
          std::string("step/") + c.scene + "/" + std::to_string(c.spheres) + "/" + rival.name;
      benchmark::RegisterBenchmark(
          name.c_str(), [&c, &rival](benchmark::State& state) { compare(state, c, rival); })
          ->UseManualTime()
          ->Iterations(g_only_settle ? 1 : c.samples)
          ->Unit(benchmark::kMillisecond);
    }
  }
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx

/// --settled=FOLDER stores settled states there; --only-settle exits after storing them.
int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    const std::string folder = "--settled=";
    if (argument == "--only-settle") {
      jfpx::bullet::g_only_settle = true;
    } else if (argument.starts_with(folder)) {
      jfpx::bullet::g_folder = argument.substr(folder.size());
    } else {
      std::fprintf(stderr, "unknown argument %s\n", argv[i]);
      return 2;
    }
  }
  jfpx::bullet::register_all();
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
