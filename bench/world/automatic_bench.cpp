/// Backend::automatic against each fixed choice, on the same input in the same run.
#include <jfpx/random.hpp>
#include <jfpx/sphere_collider.hpp>

#include "bench/sphere_collider/inputs.hpp"
#include "bench/world/samples.hpp"

#include <memory>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bench {
namespace {

struct Contender {
  std::string name;
  SphereColliderOptions options;
  std::unique_ptr<SphereCollider> collider = {};
  int calls = 1;                ///< in each round: about a millisecond of them
  std::vector<double> us = {};  ///< a call, on average of each round
};

/// Larger searches among all pairs lose by far and would take long.
constexpr std::size_t most_for_all_pairs(Backend backend) {
  return backend == Backend::cpu ? 4096 : 16384;
}
/// Where its memory happens to lie makes a search among 32 spheres up to 1.6 times as long:
/// colliders that choose the same then differ by chance. So each is made anew, elsewhere, this many
/// times.
constexpr int kPlaces = 5;
constexpr int kRounds = 7;  ///< in each place

std::vector<Contender> contenders_for(std::size_t n, const CostModel& costs) {
  std::vector<Contender> contenders;
  const auto add = [&](const std::string& name, const SphereColliderOptions& options) {
    contenders.push_back({name, options});
  };
  for (const Backend backend : {Backend::cpu, Backend::cuda}) {
    if (backend == Backend::cuda && !cuda_is_usable()) continue;
    for (const auto algorithm : {SphereAlgorithm::all_pairs, SphereAlgorithm::sorted_tiles}) {
      if (algorithm == SphereAlgorithm::all_pairs && n > most_for_all_pairs(backend)) continue;
      add(std::string(to_string(backend)) + "_" +
              (algorithm == SphereAlgorithm::all_pairs ? "all_pairs" : "sorted_tiles"),
          {.backend = backend, .algorithm = algorithm});
    }
  }
  SphereColliderOptions automatic{.costs = costs};
  automatic.costs.cuda_start_ms = 0;  // the others have started it
  add("automatic", automatic);
  return contenders;
}

/// Makes all colliders anew, with gaps of random size between their memory.
void place(std::vector<Contender>& contenders, std::span<const SphereInstance> spheres,
           Random& random) {
  std::vector<std::unique_ptr<std::byte[]>> gaps;
  for (Contender& c : contenders) {
    c.collider = make_sphere_collider(c.options);
    gaps.push_back(std::make_unique<std::byte[]>(64 * (1 + random.below(64))));
    c.collider->find_contacts(spheres);
  }
}

/// Rounds in which everybody has a turn share the noise of the machine. In each the order is
/// another, and a turn begins with calls that do not count: after waiting for a GPU a processor is
/// slow.
void measure(std::vector<Contender>& contenders, std::span<const SphereInstance> spheres,
             Random& random) {
  for (Contender& c : contenders) {
    const auto call = [&] { c.collider->find_contacts(spheres); };
    call();
    const double us = microseconds_of(call);
    c.calls = static_cast<int>(std::clamp(1e3 / us, 1.0, 2000.0));
    if (c.name != "automatic") continue;
    // It tries other ways after some 130 calls, but not before 8 ms: 50 calls or so, seldom again.
    // What is measured comes later or, where calls take long, before.
    const double warm_up = us < 2e3 ? std::max(2e4 / us, std::clamp(2e5 / us, 250.0, 2000.0))
                                    : std::max(2e5 / us, 12.0);
    for (int i = 0; i < warm_up; ++i) call();
  }
  std::vector<Contender*> order;
  for (Contender& c : contenders) order.push_back(&c);
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t k = order.size(); k > 1; --k) std::swap(order[k - 1], order[random.below(k)]);
    for (Contender* turn : order) {
      Contender& c = *turn;
      for (int i = 0; i < c.calls / 2; ++i) c.collider->find_contacts(spheres);
      c.us.push_back(microseconds_of([&] {
                       for (int i = 0; i < c.calls; ++i) c.collider->find_contacts(spheres);
                     }) /
                     c.calls);
    }
  }
}

/// Median of the ratios round by round to whoever of the others has the least median: what slows a
/// round slows both.
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
    for (int i = 0; i < kPlaces; ++i) {
      place(contenders, spheres, random);
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

/// An argument --costs=FILE names costs that `jfpx calibrate --json FILE` has measured.
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
