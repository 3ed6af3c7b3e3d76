/// Times of the steps of worlds on GPUs:
/// device_steps [--devices 0,0] SCENE SPHERES STEPS [SCENE SPHERES STEPS]...
/// Prints the median of the last 100 steps, with all bodies awake, and of 20 calls of states() each
/// of which follows another step. "shuffled" is `pile` with its
/// bodies in a random order. The boxes of `mixed` do not count as spheres.
#include <jfpx/error.hpp>
#include <jfpx/random.hpp>
#include <jfpx/world.hpp>

#include "bench/world/samples.hpp"
#include "src/base/stopwatch.hpp"
#include "src/scenes/scenes.hpp"

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

namespace {

jfpx::Scene make_scene(const std::string& name, std::uint32_t spheres) {
  jfpx::Scene scene = jfpx::scenes::make(name == "shuffled" ? "pile" : name, {.spheres = spheres});
  scene.sleep.enabled = false;
  if (name == "shuffled") {
    jfpx::Random random(1);
    for (std::size_t i = scene.bodies.size(); i > 1; --i) {
      std::swap(scene.bodies[i - 1], scene.bodies[random.below(i)]);
    }
  }
  return scene;
}

void measure(const std::vector<int>& devices, const std::string& name, std::uint32_t spheres,
             int steps) {
  const jfpx::Scene scene = make_scene(name, spheres);
  jfpx::World world(
      scene, {.collider = {.backend = jfpx::Backend::cuda}, .devices = devices, .threads = 0});
  std::vector<double> total, detect, resolve, read;
  jfpx::StepReport report;
  for (int n = 0; n < steps; ++n) {
    report = world.step();
    if (!report.device_failure.empty()) throw jfpx::DeviceError(report.device_failure);
    if (n < steps - 100) continue;
    total.push_back(report.total_ms);
    detect.push_back(report.detect_ms);
    resolve.push_back(report.resolve_ms);
  }
  const std::uint64_t hash = world.state_hash();
  std::vector<jfpx::BodyState> states;
  for (int n = 0; n < 20; ++n) {
    world.step();
    jfpx::Stopwatch watch;
    world.states(&states);
    read.push_back(watch.lap_ms());
  }
  std::printf("%-14s %9u %6d %10" PRIu64 " %8.3f %8.3f %8.3f %9.3f   %016" PRIx64 "\n",
              name.c_str(), spheres, steps, report.contacts, jfpx::bench::median(total),
              jfpx::bench::median(detect), jfpx::bench::median(resolve), jfpx::bench::median(read),
              hash);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<int> devices;
  if (argc > 2 && std::string(argv[1]) == "--devices") {
    for (char* at = argv[2];; ++at) {
      devices.push_back(static_cast<int>(std::strtol(at, &at, 10)));
      if (*at != ',') break;
    }
    argc -= 2;
    argv += 2;
  }
  if (argc < 4 || argc % 3 != 1) {
    std::fprintf(
        stderr,
        "usage: device_steps [--devices 0,0] SCENE SPHERES STEPS [SCENE SPHERES STEPS]...\n");
    return 2;
  }
  try {
    std::printf(
        "scene            spheres  steps   contacts  step ms   detect    solve  states()   hash\n");
    for (int i = 1; i < argc; i += 3) {
      measure(devices, argv[i], static_cast<std::uint32_t>(std::strtoul(argv[i + 1], nullptr, 10)),
              std::atoi(argv[i + 2]));
    }
  } catch (const jfpx::Error& error) {
    std::fprintf(stderr, "device_steps: %s\n", error.what());
    return 1;
  }
}
