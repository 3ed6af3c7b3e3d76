/// Pinned hashes of native runs, equal for every compiler and optimization level. A changed hash
/// means changed results for every user; a new hash requires an entry in CHANGELOG.md. A program
/// without a test framework, so that flavours/ can build it quickly in many ways. The arguments are
/// numbers of threads, used one after the other; the default is 1.
#include <jfpx/random.hpp>
#include <jfpx/thesis/worst_first.hpp>
#include <jfpx/world.hpp>

#include "src/base/hash64.hpp"
#include "src/demos/demo.hpp"
#include "src/scenes/scenes.hpp"
#include "tests/world/joint_scene.hpp"

#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <vector>

namespace jfpx {
namespace {

struct Pin {
  const char* scene;
  std::uint32_t spheres;
  int steps;
  std::uint64_t float_hash, double_hash;
};

/// With Solver::worst_first.
constexpr Pin kPins[] = {
    {"boxes-and-balls", 16, 300, 0xe05d748f56476ecau, 0xe6d10396327e15fau},
    {"pile", 100, 100, 0x8f7cb142a91b08deu, 0x5082c8d7fa98388cu},
    {"gas", 200, 100, 0xa10f790439c09a40u, 0x0d5838aaa644c8b3u},
    {"columns", 64, 60, 0x47c461faaac49dd3u, 0x260268dbd8e72d72u},
    {"overlap", 32, 60, 0xf2230bd18b8b5575u, 0x7b88a66b3fc8384bu},
    {"lattice", 125, 30, 0x954b8ff8f9bf4aa0u, 0xffd382557645e418u},
    {"polydisperse", 100, 60, 0x53a5b2155ebb9b95u, 0xdda07c7f25f8daa8u},
    {"mixed", 40, 150, 0x15b44f1a64529c74u, 0x35ede806a2626cd5u},
    {"big-ballistic", 12, 200, 0x9afc83700278eeeau, 0x91aef0ced8d642f8u},
    // Enough for several threads to sort and search cells.
    {"polydisperse", 20000, 3, 0x83f37a5b83aeda08u, 0x505dd13569439f7bu},
};

/// With Solver::soft_step.
constexpr Pin kSoftStepPins[] = {
    {"pile", 100, 100, 0xe20119f80b9573f7u, 0xb7927b6441f83c2fu},
    {"heap", 100, 400, 0x1a6d03866b8c7cb0u, 0xb608a422b5a10a10u},
    {"gas", 200, 100, 0xa8788d5639ea9d11u, 0xc2e937f96631d72bu},
    {"columns", 64, 60, 0x9678de459fd6c2dbu, 0x0f973ef94576d375u},
    {"overlap", 32, 60, 0x1aa5330e3d17bbf6u, 0xe54219b9024930d0u},
    {"lattice", 125, 30, 0xc1b4bc0d5892cdceu, 0xfdde9b1863a93df8u},
    {"polydisperse", 100, 60, 0xd62f77d75c6f7d7eu, 0x367a150899394731u},
    {"mixed", 40, 150, 0x55ba1c236c913c6eu, 0x1684125c518b8420u},
    {"capsules", 20, 200, 0xb07904e024b50ff0u, 0x8e69fe3107a6f3deu},
    {"terrain", 20, 200, 0x446c601086c8cea6u, 0x68330b32cfe2a22bu},
    {"ragdolls", 9, 200, 0xab64ca88d9f93b2fu, 0x1c21342bd079715eu},
    {"bridge", 30, 200, 0xbe74eb6733001297u, 0x89ea0582bb4e13b9u},
    // Enough for several threads to solve the contacts of a color.
    {"polydisperse", 20000, 3, 0x1fc1c4e3ef568f9au, 0xd2fc64b8df212ecbu},
    {"columns", 20000, 3, 0xf1dc6c610329eee1u, 0x8cfcea0c434ee1fdu},
};

/// joint_scene() with Solver::soft_step.
constexpr Pin kJointPin{"joints", 100, 200, 0x672fc042686c713fu, 0x5814ae5d36cc4001u};

struct DemoPin {
  const char* demo;
  int steps;
  std::uint64_t float_hash, double_hash;
};

constexpr DemoPin kDemoPins[] = {
    {"ballistic", 400, 0xec60440246cf9935u, 0x92cb3b64182c2893u},
    {"big-ballistic", 400, 0x96fc4cc922d2b100u, 0xae8136d06ad154d1u},
    {"flight", 900, 0xc255fca24d5f635eu, 0xa3eabd790ad788b7u},
};

/// Vector width for a number of threads: every width occurs; 1 thread uses the widest available.
SimdLevel simd_of(unsigned threads) {
  constexpr SimdLevel kLevels[] = {SimdLevel::automatic, SimdLevel::scalar, SimdLevel::sse2,
                                   SimdLevel::avx2, SimdLevel::avx512};
  return kLevels[(threads - 1) % std::size(kLevels)];
}

/// Returns false and prints the reason if the run fails, resolves nothing, or ends with another
/// hash.
bool check(const Pin& pin, Scene scene, Solver solver, unsigned threads) {
  WorldSettings settings;
  settings.collider = {.backend = Backend::cpu, .simd = simd_of(threads)};
  settings.threads = threads;
  // Small sets use several threads only in the all-pairs search.
  if (threads > 1 && pin.spheres < 20000) {
    settings.collider.algorithm = SphereAlgorithm::all_pairs;
  }
  scene.solver = solver;
  World world(scene, settings);
  std::uint64_t resolved = 0;
  bool finite = true;
  for (int n = 0; n < pin.steps; ++n) {
    const StepReport report = world.step();
    resolved += solver == Solver::worst_first
                    ? report.position_iterations + report.velocity_iterations
                    : report.contacts;
    finite = finite && !report.non_finite;
  }
  const std::uint64_t expected = sizeof(Real) == 4 ? pin.float_hash : pin.double_hash;
  const bool same = world.state_hash() == expected;
  std::printf("%-11s %-16s %5" PRIu32 " spheres %5d steps  %016" PRIx64 "  %s\n", to_string(solver),
              pin.scene, pin.spheres, pin.steps, world.state_hash(),
              !finite         ? "WRONG: a body is not finite"
              : resolved == 0 ? "WRONG: no contact was resolved"
              : !same         ? "WRONG: another hash is pinned"
                              : "as pinned");
  return finite && resolved > 0 && same;
}

bool check(const Pin& pin, Solver solver, unsigned threads) {
  return check(pin, scenes::make(pin.scene, {.spheres = pin.spheres, .seed = 1}), solver, threads);
}

/// A demo with random inputs except its reset. The hash covers the states of all steps, because
/// rounds are added and removed.
bool check(const DemoPin& pin) {
  const auto demo = demos::make(pin.demo);
  const std::size_t reset = find_control(*demo, "reset");
  Random random(1);
  Hash64 hash;
  bool finite = true;
  std::size_t control = reset;
  std::vector<demos::Input> inputs;
  for (int n = 0; n < pin.steps; ++n) {
    inputs.clear();
    if (n % 5 == 0) {
      if (control != reset) inputs.push_back({control, false});
      control = random.below(demo->controls().size());
      if (control != reset) inputs.push_back({control, true});
    }
    finite = !demo->step(inputs).non_finite && finite;
    hash.add_word(demo->state_hash());
  }
  const std::uint64_t expected = sizeof(Real) == 4 ? pin.float_hash : pin.double_hash;
  const bool same = hash.value() == expected;
  std::printf("%-16s  as a demo  %5d steps  %016" PRIx64 "  %s\n", pin.demo, pin.steps,
              hash.value(),
              !finite ? "WRONG: a body is not finite"
              : !same ? "WRONG: another hash is pinned"
                      : "as pinned");
  return finite && same;
}

}  // namespace
}  // namespace jfpx

int main(int count, char** arguments) {
  jfpx::thesis::enable();
  bool all = true;
  for (int i = 1; i < count || i == 1; ++i) {
    const unsigned long threads = i < count ? std::strtoul(arguments[i], nullptr, 10) : 1;
    std::printf("with %lu threads:\n", threads);
    for (const jfpx::Pin& pin : jfpx::kPins) {
      all = jfpx::check(pin, jfpx::Solver::worst_first, static_cast<unsigned>(threads)) && all;
    }
    for (const jfpx::Pin& pin : jfpx::kSoftStepPins) {
      all = jfpx::check(pin, jfpx::Solver::soft_step, static_cast<unsigned>(threads)) && all;
    }
    all = jfpx::check(jfpx::kJointPin, jfpx::test::joint_scene(), jfpx::Solver::soft_step,
                      static_cast<unsigned>(threads)) &&
          all;
  }
  for (const jfpx::DemoPin& pin : jfpx::kDemoPins) all = jfpx::check(pin) && all;
  return all ? 0 : 1;
}
