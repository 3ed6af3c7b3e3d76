/// Benchmark of sphere contacts on the CPU: algorithms, vector widths and sizes, compared with a
/// scalar double loop.
#include <jfpx/random.hpp>
#include <jfpx/sphere_collider.hpp>

#include "bench/sphere_collider/plain_loop.hpp"

#include <benchmark/benchmark.h>

#include <cmath>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using Spheres = std::vector<SphereInstance>;

/// Returns the side of a cube with `contacts` contacts per sphere: at volume fraction phi,
/// uniformly random centres of equal spheres have 4*phi contacts.
Real side_of_gas(std::size_t n, double contacts) {
  return static_cast<Real>(std::cbrt(static_cast<double>(n) * 4.18879020478639 * 4 / contacts));
}

Spheres gas(std::size_t n, double contacts = 3) {
  Random random(1);
  const Real side = side_of_gas(n, contacts);
  Spheres spheres(n);
  for (SphereInstance& s : spheres) s = {random.uniform_in_box({0, 0, 0}, {side, side, side}), 1};
  return spheres;
}

/// No contacts: spheres of radius 1 on a cubic lattice with spacing 3.
Spheres sparse(std::size_t n) {
  const auto edge = static_cast<std::size_t>(std::ceil(std::cbrt(static_cast<double>(n))));
  Spheres spheres(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 cell{static_cast<Real>(i % edge), static_cast<Real>(i / edge % edge),
                    static_cast<Real>(i / edge / edge)};
    spheres[i] = {cell * 3, 1};
  }
  return spheres;
}

/// The tower of the thesis at rest (thesis 5): spheres along a line, without contacts.
Spheres tower(std::size_t n) {
  Spheres spheres(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Real y = 1 + 3 * static_cast<Real>(i);
    spheres[i] = {{Real(0.1) * y, y, 0}, 1};
  }
  return spheres;
}

/// Radii over four decades, uniform in the logarithm, with about 3 contacts per sphere.
Spheres polydisperse(std::size_t n) {
  Random random(1);
  Spheres spheres(n);
  const Real side = Real(4.6) * std::cbrt(static_cast<Real>(n));
  for (SphereInstance& s : spheres) {
    const Real radius =
        static_cast<Real>(std::pow(10.0, 4.0 * static_cast<double>(random.uniform()) - 3));
    s = {random.uniform_in_box({0, 0, 0}, {side, side, side}), radius};
  }
  return spheres;
}

Spheres giant_in_dust(std::size_t n) {
  Spheres spheres = gas(n);
  const Real side = side_of_gas(n, 3);
  spheres[n / 2] = {{side / 2, side / 2, -side}, side * Real(1.02)};
  return spheres;
}

/// A gas with one sphere of five times the radius, which must not increase the cell size of the
/// others.
Spheres larger_one(std::size_t n) {
  Spheres spheres = gas(n);
  spheres[n / 2].radius = 5;
  return spheres;
}

/// A dense gas with a thousandth of its spheres up to 1e9 m away.
Spheres outliers(std::size_t n) {
  Spheres spheres = gas(n);
  Random random(2);
  for (std::size_t i = 0; i < n; i += 1000) {
    spheres[i].centre = random.uniform_in_box({-1e9, -1e9, -1e9}, {1e9, 1e9, 1e9});
  }
  return spheres;
}

Spheres coincident(std::size_t n) { return Spheres(n, {{1, 2, 3}, 1}); }

void count(benchmark::State& state, std::size_t spheres, std::size_t contacts) {
  using benchmark::Counter;
  const auto n = static_cast<double>(spheres);
  state.counters["spheres"] = n;
  state.counters["contacts"] = static_cast<double>(contacts);
  state.counters["spheres_per_s"] = Counter(n, Counter::kIsIterationInvariantRate);
  // Lower bound of the memory traffic: every input and output once.
  state.counters["bytes"] =
      n * sizeof(SphereInstance) + static_cast<double>(contacts) * sizeof(SphereContact);
}

void run_plain(benchmark::State& state, Spheres (*make)(std::size_t)) {
  const Spheres spheres = make(static_cast<std::size_t>(state.range(0)));
  std::vector<SphereContact> contacts;
  for (auto _ : state) {
    plain_loop(spheres, &contacts);
    benchmark::DoNotOptimize(contacts.data());
  }
  const auto n = static_cast<double>(spheres.size());
  state.counters["pair_tests_per_s"] =
      benchmark::Counter(n * (n - 1) / 2, benchmark::Counter::kIsIterationInvariantRate);
  count(state, spheres.size(), contacts.size());
}

void run_collider(benchmark::State& state, const Spheres& spheres,
                  const SphereColliderOptions& options) {
  const auto collider = make_sphere_collider(options);
  std::size_t contacts = collider->find_contacts(spheres).size();
  for (auto _ : state) {
    contacts = collider->find_contacts(spheres).size();
    benchmark::DoNotOptimize(contacts);
  }
  if (collider->algorithm() == SphereAlgorithm::all_pairs) {
    const auto n = static_cast<double>(spheres.size());
    state.counters["pair_tests_per_s"] =
        benchmark::Counter(n * (n - 1) / 2, benchmark::Counter::kIsIterationInvariantRate);
  }
  count(state, spheres.size(), contacts);
}

struct Level {
  const char* name;
  SimdLevel level;
};
constexpr Level kLevels[] = {{"scalar", SimdLevel::scalar},
                             {"sse2", SimdLevel::sse2},
                             {"avx2", SimdLevel::avx2},
                             {"avx512", SimdLevel::avx512}};

void add(const std::string& name, Spheres (*make)(std::size_t), std::int64_t n,
         SphereAlgorithm algorithm, SimdLevel level, unsigned threads = 1) {
  const SphereColliderOptions options{
      .backend = Backend::cpu, .algorithm = algorithm, .threads = threads, .simd = level};
  benchmark::RegisterBenchmark(name.c_str(),
                               [=](benchmark::State& state) {
                                 run_collider(state, make(static_cast<std::size_t>(state.range(0))),
                                              options);
                               })
      ->Arg(n)
      ->Unit(benchmark::kMicrosecond);
}

void add_all() {
  using enum SphereAlgorithm;
  Spheres (*const gas3)(std::size_t) = [](std::size_t n) { return gas(n); };
  for (const std::int64_t n : {448, 4096}) {
    benchmark::RegisterBenchmark("sparse/plain_loop", run_plain, sparse)
        ->Arg(n)
        ->Unit(benchmark::kMicrosecond);
    for (const Level& l : kLevels)
      add(std::string("sparse/all_pairs/") + l.name, sparse, n, all_pairs, l.level);
  }
  add("tower/automatic", tower, 448, automatic, SimdLevel::automatic);
  for (const std::int64_t n : {128, 256, 512, 768, 1024, 4096, 8192}) {
    add("gas/all_pairs", gas3, n, all_pairs, SimdLevel::automatic);
    add("gas/sorted", gas3, n, grid, SimdLevel::automatic);
  }
  for (const std::int64_t n : {10'000, 32'000, 100'000, 320'000, 1'000'000}) {
    add("gas/sorted", gas3, n, grid, SimdLevel::automatic);
  }
  for (const Level& l : kLevels)
    add(std::string("gas/sorted/") + l.name, gas3, 100'000, grid, l.level);
  for (const unsigned threads : {1u, 2u}) {
    add("gas/sorted/threads" + std::to_string(threads), gas3, 1'000'000, grid, SimdLevel::automatic,
        threads);
  }
  for (const std::int64_t n : {100'000, 1'000'000}) {
    add("polydisperse/sorted", polydisperse, n, grid, SimdLevel::automatic);
    add("giant_in_dust/sorted", giant_in_dust, n, grid, SimdLevel::automatic);
    add("larger_one/sorted", larger_one, n, grid, SimdLevel::automatic);
    add("outliers/sorted", outliers, n, grid, SimdLevel::automatic);
  }
  add("coincident/sorted", coincident, 2'000, grid, SimdLevel::automatic);
  add("coincident/all_pairs", coincident, 2'000, all_pairs, SimdLevel::automatic);
}

void find_touching(benchmark::State& state) {
  const Spheres spheres = gas(100'000);
  Random random(3);
  // Half of the pairs touch and half are random, so neither branches nor accesses are predictable.
  const auto collider = make_sphere_collider({.backend = Backend::cpu});
  const ContactSpan contacts = collider->find_contacts(spheres);
  std::vector<SpherePair> pairs(static_cast<std::size_t>(state.range(0)));
  for (SpherePair& p : pairs) {
    const SphereContact& c = contacts[random.below(contacts.size())];
    p = {c.a, c.b};
    if (random.below(2) == 0) p.b = static_cast<SphereIndex>(random.below(spheres.size()));
  }
  for (auto _ : state) benchmark::DoNotOptimize(collider->find_touching(spheres, pairs).data());
  state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(find_touching)->Arg(130'000)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace JFPX_ABI
}  // namespace jfpx

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::AddCustomContext("processor", jfpx::available_backends().front().device);
  jfpx::add_all();
  benchmark::RunSpecifiedBenchmarks();
}
