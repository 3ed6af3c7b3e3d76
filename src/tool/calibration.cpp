/// Measurement of the costs of sphere collision and of steps on this machine.
#include "src/tool/calibration.hpp"

#include <jfpx/error.hpp>
#include <jfpx/random.hpp>
#include <jfpx/sphere_collider.hpp>
#include <jfpx/world.hpp>

#include "src/scenes/scenes.hpp"
#include "src/tool/cost_fit.hpp"

#include <algorithm>
#include <chrono>
#include <limits>
#include <memory>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {
namespace {

using Clock = std::chrono::steady_clock;
using Us = std::chrono::duration<double, std::micro>;

/// Contacts per sphere: a gas without contacts, a pile, a dense packing.
constexpr Real kDensities[] = {0, 3, 12};
constexpr std::uint32_t kFew[] = {4, 32, 128, 512, 2048};
constexpr std::uint32_t kMany[] = {4, 128, 512, 2048, 8192, 32768};
constexpr std::uint32_t kFewForDevice[] = {128, 512, 2048, 8192};
constexpr std::uint32_t kManyForDevice[] = {512, 2048, 8192, 32768, 131072};
constexpr std::uint32_t kPairs[] = {256, 2048, 16384, 131072};
constexpr std::uint32_t kCopied[] = {16384, 131072, 524288};
constexpr std::uint32_t kBodies[] = {64, 512, 4096};
constexpr std::uint32_t kBodiesForDevice[] = {512, 8000, 64000};

std::vector<SphereInstance> make_spheres(std::uint32_t count, Real density) {
  if (density > 0) return scenes::random_spheres(count, density, 1);
  std::vector<SphereInstance> spheres = scenes::random_spheres(count, 3, 1);
  for (SphereInstance& s : spheres) s.radius *= Real(1e-3);
  return spheres;
}

/// The minimum time of a call [us]; other load on the machine only increases the time.
template <class Call>
double least_us(const Call& call) {
  constexpr Us kBudget{8e3};
  constexpr int kLeast = 3;
  call();  // allocates buffers
  double least = std::numeric_limits<double>::infinity();
  const Clock::time_point begin = Clock::now();
  for (int n = 0; n < kLeast || Clock::now() - begin < kBudget; ++n) {
    const Clock::time_point start = Clock::now();
    call();
    least = std::min(least, Us(Clock::now() - start).count());
  }
  return std::max(least, 1e-3);
}

class Bench {
 public:
  explicit Bench(std::function<void(std::uint64_t, std::uint64_t)> progress)
      : progress_(std::move(progress)) {}

  void expect(std::size_t measurements) { total_ += measurements; }

  /// Samples of one search algorithm at all densities.
  std::vector<CostSample> search(Backend backend, SphereAlgorithm algorithm,
                                 std::span<const std::uint32_t> sizes) {
    const auto collider = make_sphere_collider({.backend = backend, .algorithm = algorithm});
    std::vector<CostSample> samples;
    for (const std::uint32_t n : sizes) {
      for (const Real density : kDensities) {
        const auto spheres = make_spheres(n, density);
        std::size_t contacts = 0;
        const double us = least_us([&] { contacts = collider->find_contacts(spheres).size(); });
        samples.push_back({search_work(n, static_cast<double>(contacts)), us});
        progress_(++done_, total_);
      }
    }
    return samples;
  }

  /// Samples of find_touching(), for lists in which half of the pairs touch. Lists of the `copied`
  /// numbers of spheres, each with one pair, measure the cost of copying bytes.
  std::vector<CostSample> given(Backend backend, std::span<const std::uint32_t> copied) {
    const auto collider = make_sphere_collider({.backend = backend});
    std::vector<CostSample> samples;
    const auto measure = [&](std::span<const SphereInstance> spheres,
                             std::span<const SpherePair> pairs) {
      // The mirror image has the same contacts, but differs in every sphere and pair. Only
      // differences from the previous call are copied to a device, so alternating calls copy all
      // bytes.
      std::vector<SphereInstance> mirrored(spheres.begin(), spheres.end());
      for (SphereInstance& s : mirrored) s.centre = -s.centre;
      std::vector<SpherePair> exchanged(pairs.begin(), pairs.end());
      for (SpherePair& p : exchanged) std::swap(p.a, p.b);
      bool mirror = false;
      const double us = least_us([&] {
        mirror = !mirror;
        if (mirror) {
          collider->find_touching(mirrored, exchanged);
        } else {
          collider->find_touching(spheres, pairs);
        }
      });
      samples.push_back(
          {test_work(static_cast<double>(spheres.size()), static_cast<double>(pairs.size())), us});
      progress_(++done_, total_);
    };
    for (const std::uint32_t m : kPairs) {
      const auto spheres = make_spheres(m / 4, 3);
      measure(spheres, some_pairs(spheres, m));
    }
    for (const std::uint32_t n : copied) {
      const auto spheres = make_spheres(n, 0);
      measure(spheres, some_pairs(spheres, 1));
    }
    return samples;
  }

  /// Samples of steps of a world of balls that touch six others.
  std::vector<CostSample> world(Backend backend, std::span<const std::uint32_t> sizes) {
    std::vector<CostSample> samples;
    for (const std::uint32_t n : sizes) {
      Scene scene = scenes::make("lattice", {.spheres = n});
      // Half of the distance of neighbours: the balls touch, and nothing separates them.
      for (BodyDef& body : scene.bodies) body.shape = Sphere{Real(0.485)};
      scene.sleep.enabled = false;
      World world(scene, {.collider = {.backend = backend}});
      const double us = least_us([&] { world.step(); });
      samples.push_back({{.spheres = static_cast<double>(scene.bodies.size())}, us});
      progress_(++done_, total_);
    }
    return samples;
  }

 private:
  static std::vector<SpherePair> some_pairs(std::span<const SphereInstance> spheres,
                                            std::uint32_t count) {
    const auto collider = make_sphere_collider({.backend = Backend::cpu});
    const ContactSpan contacts = collider->find_contacts(spheres);
    Random random(1);
    std::vector<SpherePair> pairs(count);
    for (SpherePair& p : pairs) {
      const auto any = static_cast<SphereIndex>(random.below(spheres.size()));
      if (contacts.empty() || random.below(2) == 0) {
        p = {any, static_cast<SphereIndex>(random.below(spheres.size()))};
      } else {
        const SphereContact& c = contacts[random.below(contacts.size())];
        p = {c.a, c.b};
      }
    }
    return pairs;
  }

  std::function<void(std::uint64_t, std::uint64_t)> progress_;
  std::uint64_t done_ = 0, total_ = 0;
};

using Term = double CostTerms::*;
constexpr Term kAllPairsTerms[] = {&CostTerms::call_us, &CostTerms::sphere_ns, &CostTerms::pair_ns,
                                   &CostTerms::contact_ns};
constexpr Term kSortedTerms[] = {&CostTerms::call_us, &CostTerms::sphere_ns,
                                 &CostTerms::contact_ns};
constexpr Term kGivenTerms[] = {&CostTerms::call_us, &CostTerms::pair_ns};
constexpr Term kWorldTerms[] = {&CostTerms::call_us, &CostTerms::sphere_ns};
constexpr Term kCopiedTerms[] = {&CostTerms::call_us, &CostTerms::byte_ns, &CostTerms::pair_ns};

void measure_cpu(Bench& bench, CostModel* costs) {
  using enum SphereAlgorithm;
  costs->cpu_all_pairs = fit_costs(bench.search(Backend::cpu, all_pairs, kFew), kAllPairsTerms);
  costs->cpu_grid = fit_costs(bench.search(Backend::cpu, grid, kMany), kSortedTerms);
  costs->cpu_given_pairs = fit_costs(bench.given(Backend::cpu, {}), kGivenTerms);
  costs->cpu_world = fit_costs(bench.world(Backend::cpu, kBodies), kWorldTerms);
}

/// @throws BackendUnavailable, DeviceError
double measure_start() {
  const Clock::time_point start = Clock::now();
  const auto spheres = make_spheres(512, 3);
  make_sphere_collider({.backend = Backend::cuda})->find_contacts(spheres);
  return 1e-3 * Us(Clock::now() - start).count();
}

void measure_cuda(Bench& bench, CostModel* costs) {
  using enum SphereAlgorithm;
  costs->cuda_given_pairs = fit_costs(bench.given(Backend::cuda, kCopied), kCopiedTerms);
  const CostTerms copies{.byte_ns = costs->cuda_given_pairs.byte_ns};
  costs->cuda_all_pairs =
      fit_costs(bench.search(Backend::cuda, all_pairs, kFewForDevice), kAllPairsTerms, copies);
  costs->cuda_grid =
      fit_costs(bench.search(Backend::cuda, grid, kManyForDevice), kSortedTerms, copies);
  costs->cuda_world = fit_costs(bench.world(Backend::cuda, kBodiesForDevice), kWorldTerms);
}

/// Measures a device, which may be missing or fail at any time, and keeps the CPU's costs.
/// @return the reason why the device was not measured; otherwise empty
template <class Measure>
std::string try_device(const Measure& measure) {
  try {
    measure();
    return {};
  } catch (const Error& error) {
    return error.what();
  }
}

}  // namespace

Calibration calibrate(const std::function<void(std::uint64_t, std::uint64_t)>& progress) {
  Calibration result;
  Bench bench(progress);
  constexpr std::size_t kD = std::size(kDensities);
  bench.expect(kD * (std::size(kFew) + std::size(kMany)) + std::size(kPairs) + std::size(kBodies));
  double start_ms = 0;
  // Measured first, because any other use would start the device.
  result.no_cuda = try_device([&] { start_ms = measure_start(); });
  if (result.no_cuda.empty()) {
    bench.expect(kD * (std::size(kFewForDevice) + std::size(kManyForDevice)) + std::size(kPairs) +
                 std::size(kCopied) + std::size(kBodiesForDevice));
  }
  measure_cpu(bench, &result.costs);
  if (!result.no_cuda.empty()) return result;
  CostModel with_cuda = result.costs;
  with_cuda.cuda_start_ms = start_ms;
  result.no_cuda = try_device([&] { measure_cuda(bench, &with_cuda); });
  if (result.no_cuda.empty()) result.costs = with_cuda;
  return result;
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
