/// Benchmark of Backend::automatic against each fixed choice, with the same input in the same run.
#include <jfpx/random.hpp>
#include <jfpx/sphere_collider.hpp>

#include "bench/sphere_collider/inputs.hpp"
#include "bench/world/samples.hpp"

#include <memory>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bench {
namespace {

/// A collider to be compared.
struct Contender {
  std::string name;
  SphereColliderOptions options;
  std::unique_ptr<SphereCollider> collider = {};
  int calls = 1;                ///< per round: about one millisecond
  std::vector<double> us = {};  ///< mean time of a call, by round
};

/// Larger searches among all pairs are not competitive and would take too long.
constexpr std::size_t max_spheres_for_all_pairs(Backend backend) {
  return backend == Backend::cpu ? 4096 : 16384;
}
/// The addresses of the buffers change the time of a search among 32 spheres by a factor of up to
/// 1.6, so colliders that make the same choice differ by chance. Therefore each collider is made
/// this many times at different addresses.
constexpr int kPlacements = 5;
constexpr int kRounds = 7;  ///< per placement

std::vector<Contender> contenders_for(std::size_t n, const CostModel& costs) {
  std::vector<Contender> contenders;
  const auto add = [&](const std::string& name, const SphereColliderOptions& options) {
    contenders.push_back({name, options});
  };
  for (const Backend backend : {Backend::cpu, Backend::cuda}) {
    if (backend == Backend::cuda && !cuda_is_usable()) continue;
    for (const auto algorithm : {SphereAlgorithm::all_pairs, SphereAlgorithm::grid}) {
      if (algorithm == SphereAlgorithm::all_pairs && n > max_spheres_for_all_pairs(backend))
        continue;
      add(std::string(to_string(backend)) + "_" +
              (algorithm == SphereAlgorithm::all_pairs ? "all_pairs" : "grid"),
          {.backend = backend, .algorithm = algorithm});
    }
  }
  SphereColliderOptions automatic{.costs = costs};
  automatic.costs.cuda_start_ms = 0;  // already started by the other colliders
  add("automatic", automatic);
  return contenders;
}

/// Makes all colliders again, with gaps of random size between their memory.
void recreate(std::vector<Contender>& contenders, std::span<const SphereInstance> spheres,
              Random& random) {
  std::vector<std::unique_ptr<std::byte[]>> gaps;
  for (Contender& c : contenders) {
    c.collider = make_sphere_collider(c.options);
    gaps.push_back(std::make_unique<std::byte[]>(64 * (1 + random.below(64))));
    c.collider->find_contacts(spheres);
  }
}

/// Measures all contenders in each round, so that they share the noise of the machine. The order is
/// random in each round. The first calls of a contender are not timed, because a processor is slow
/// after waiting for a GPU.
void measure(std::vector<Contender>& contenders, std::span<const SphereInstance> spheres,
             Random& random) {
  for (Contender& c : contenders) {
    const auto call = [&] { c.collider->find_contacts(spheres); };
    call();
    const double us = microseconds_of(call);
    c.calls = static_cast<int>(std::clamp(1e3 / us, 1.0, 2000.0));
    if (c.name != "automatic") continue;
    // The first trials of other alternatives take place after about 130 calls and at least 8 ms,
    // and later ones are rare. The measurement follows the first trials, or precedes them if calls
    // are long.
    const double warm_up = us < 2e3 ? std::max(2e4 / us, std::clamp(2e5 / us, 250.0, 2000.0))
                                    : std::max(2e5 / us, 12.0);
    for (int i = 0; i < warm_up; ++i) call();
  }
  std::vector<Contender*> order;
  for (Contender& c : contenders) order.push_back(&c);
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t k = order.size(); k > 1; --k) std::swap(order[k - 1], order[random.below(k)]);
    for (Contender* contender : order) {
      Contender& c = *contender;
      for (int i = 0; i < c.calls / 2; ++i) c.collider->find_contacts(spheres);
      c.us.push_back(microseconds_of([&] {
                       for (int i = 0; i < c.calls; ++i) c.collider->find_contacts(spheres);
                     }) /
                     c.calls);
    }
  }
}

/// Returns the median, over the rounds, of the ratio to the contender with the smallest median.
/// Disturbances of a round affect both.
double ratio_to_best(const std::vector<Contender>& contenders) {
  const std::span others(contenders.data(), contenders.size() - 1);
  const auto best = std::min_element(others.begin(), others.end(),
                                     [](auto& a, auto& b) { return median(a.us) < median(b.us); });
  std::vector<double> ratios;
  for (std::size_t round = 0; round < best->us.size(); ++round) {
    ratios.push_back(contenders.back().us[round] / best->us[round]);
  }
  return median(ratios);
}

void compare(benchmark::State& state, const Input& input, std::size_t n, const CostModel& costs) {
  const std::vector<SphereInstance> spheres = input.make(n);
  std::vector<Contender> contenders = contenders_for(n, costs);
  double automatic = 0;
  for (auto _ : state) {
    Random random(1);
    for (int i = 0; i < kPlacements; ++i) {
      recreate(contenders, spheres, random);
      measure(contenders, spheres, random);
    }
    for (const Contender& c : contenders) {
      const double us = median(c.us);
      state.counters[c.name + "_us"] = us;
      if (c.name == "automatic") automatic = us;
    }
    state.SetIterationTime(automatic * 1e-6);
  }
  const SphereCollider& chooser = *contenders.back().collider;
  state.counters["spheres"] = static_cast<double>(n);
  state.counters["contacts"] =
      static_cast<double>(contenders.back().collider->find_contacts(spheres).size());
  state.counters["ratio"] = ratio_to_best(contenders);
  state.SetLabel(std::string(to_string(chooser.backend())) + ", " +
                 std::string(to_string(chooser.algorithm())));
}

void register_all(const CostModel& costs) {
  for (const char* name : {"gas", "polydisperse", "line", "coincident", "overlap"}) {
    for (const std::size_t n :
         {2, 8, 32, 128, 256, 448, 700, 1024, 2048, 4096, 16384, 65536, 262144}) {
      if (name == std::string_view("overlap") && n > 2048) continue;
      benchmark::RegisterBenchmark(
          (std::string("automatic/") + name + "/" + std::to_string(n)).c_str(),
          [=](benchmark::State& state) { compare(state, input(name), n, costs); })
          ->UseManualTime()
          ->Iterations(1)
          ->Unit(benchmark::kMicrosecond);
    }
  }
}

}  // namespace
}  // namespace bench
}  // namespace JFPX_ABI
}  // namespace jfpx

/// The option --costs=FILE reads costs that `jfpx calibrate --json FILE` measured.
int main(int argc, char** argv) {
  constexpr std::string_view kCosts = "--costs=";
  jfpx::CostModel costs;
  bool measured = false;
  std::vector<char*> arguments;
  for (char* argument : std::span(argv, static_cast<std::size_t>(argc))) {
    if (std::string_view(argument).starts_with(kCosts)) {
      costs = jfpx::load_cost_model(argument + kCosts.size()).costs;
      measured = true;
    } else {
      arguments.push_back(argument);
    }
  }
  benchmark::AddCustomContext("costs", measured ? "measured by jfpx calibrate" : "defaults");
  jfpx::bench::register_all(costs);
  return jfpx::bench::run_benchmarks(static_cast<int>(arguments.size()), arguments.data());
}
