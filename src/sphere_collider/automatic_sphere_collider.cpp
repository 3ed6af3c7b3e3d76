/// Backend::automatic: selects backend and algorithm for each call (thesis 5.4).
#include "src/sphere_collider/automatic_sphere_collider.hpp"

#include <jfpx/error.hpp>

#include "src/base/stopwatch.hpp"
#include "src/sphere_collider/choice_reason.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// Work of find_touching(). The bytes are those of the first call with a list in which all pairs
/// touch, because the changes and the touching pairs are unknown before the call.
ColliderWork work_of(std::span<const SphereInstance> spheres, std::span<const SpherePair> pairs) {
  const auto n = static_cast<double>(spheres.size()), m = static_cast<double>(pairs.size());
  return {.spheres = n,
          .pairs = m,
          .bytes = n * sizeof(SphereInstance) + m * (sizeof(SpherePair) + sizeof(PairContact))};
}

/// Index of the collider with a given algorithm.
std::size_t index_of(SphereAlgorithm algorithm) {
  return algorithm == SphereAlgorithm::all_pairs ? 0 : 1;
}

/// Alternatives whose predicted time is this many times that of the fastest are not tried on a
/// starting device: all pairs of a million spheres would take minutes.
constexpr double kMaxSlowdown = 4;

}  // namespace

AutomaticSphereCollider::Calls::Calls(std::vector<Way> ways_of_calls)
    : ways(std::move(ways_of_calls)), chooser([this] {
        std::vector<TimeChooser::Alternative> alternatives;
        for (const Way& way : ways) {
          // Device calls are too long to share a decision.
          const bool device = way.backend == Backend::cuda;
          alternatives.push_back({.dormant = device, .batched = !device});
        }
        return TimeChooser(alternatives);
      }()) {}

auto AutomaticSphereCollider::ways_to_search(const SphereColliderOptions& options, bool with_cuda)
    -> std::vector<Way> {
  using enum SphereAlgorithm;
  const CostModel& costs = options.costs;
  std::vector<Way> ways = {
      {Backend::cpu, all_pairs, costs.cpu_all_pairs},
      {Backend::cpu, grid, costs.cpu_grid},
      {Backend::cuda, all_pairs, costs.cuda_all_pairs},
      {Backend::cuda, grid, costs.cuda_grid},
  };
  std::erase_if(ways, [&](const Way& way) {
    return (way.backend == Backend::cuda && !with_cuda) ||
           (options.algorithm != automatic && options.algorithm != way.algorithm);
  });
  return ways;
}

auto AutomaticSphereCollider::ways_to_test(const SphereColliderOptions& options, bool with_cuda)
    -> std::vector<Way> {
  using enum SphereAlgorithm;
  std::vector<Way> ways = {{Backend::cpu, automatic, options.costs.cpu_given_pairs}};
  if (with_cuda) ways.push_back({Backend::cuda, automatic, options.costs.cuda_given_pairs});
  return ways;
}

AutomaticSphereCollider::AutomaticSphereCollider(const SphereColliderOptions& options,
                                                 SphereColliderMaker make, bool with_cuda)
    : options_(options),
      make_(std::move(make)),
      search_(ways_to_search(options, with_cuda)),
      given_(ways_to_test(options, with_cuda)),
      starter_(1e3 * options.costs.cuda_start_ms) {
  if (!with_cuda) starter_.cancel();
}

/// Whether the last decision also covers this call, which `calls.by` then computes.
bool AutomaticSphereCollider::reuse_decision(Calls& calls, std::size_t spheres, std::size_t pairs) {
  if (calls.following > 0 && spheres == calls.spheres && pairs == calls.pairs) {
    --calls.following;
    last_ = &calls;
    return true;
  }
  calls.spheres = spheres;
  calls.pairs = pairs;
  return false;
}

/// Executes `call` with the selected collider, or with the CPU if the device fails.
/// @param keep_input returns a function that repeats the call with a copy of its input
template <class Call, class Measure, class KeepInput>
auto AutomaticSphereCollider::compute(Calls& calls, const ColliderWork& expected, const Call& call,
                                      const Measure& measure, const KeepInput& keep_input) {
  device_failure_.clear();
  calls.following = 0;
  take_started_device();
  start_device_if_it_pays(calls, expected, keep_input);
  std::array<double, TimeChooser::kMaxAlternatives> predicted_us{};
  std::ranges::transform(calls.ways, predicted_us.begin(),
                         [&](const Way& way) { return microseconds(way.terms, expected); });
  while (true) {
    const auto decision =
        calls.chooser.choose(expected.pairs, std::span(predicted_us).first(calls.ways.size()));
    const auto& [backend, algorithm, terms] = calls.ways[decision.alternative];
    try {
      calls.by = &collider(backend, algorithm);
      Stopwatch watch;
      const auto result = call(*calls.by);
      const double us = watch.lap_us();
      calls.chooser.record(us, microseconds(terms, measure(result)));
      if (device_failure_.empty()) calls.following = decision.following;
      calls.reason =
          device_lost_ ? ChoiceReason::device_failed : to_choice_reason(calls.chooser.reason());
      calls.backend = backend;
      last_ = &calls;
      if (algorithm != SphereAlgorithm::automatic) algorithm_ = algorithm;
      return result;
    } catch (const BackendUnavailable&) {
      if (backend == Backend::cpu) throw;
      give_up_device({});
    } catch (const DeviceError& error) {
      if (backend == Backend::cpu) throw;
      give_up_device(error.what());
    } catch (const OutOfMemory& error) {
      if (backend == Backend::cpu) throw;
      give_up_device(error.what());
    }
  }
}

template <class Item>
std::span<const Item> AutomaticSphereCollider::search(
    std::span<const SphereInstance> spheres,
    std::span<const Item> (SphereCollider::*find)(std::span<const SphereInstance>)) {
  if (reuse_decision(search_, spheres.size(), 0)) return (search_.by->*find)(spheres);
  const auto n = static_cast<double>(spheres.size());
  const auto work = [&](double contacts) {
    return ColliderWork{.spheres = n,
                        .pairs = n * (n - 1) / 2,
                        .contacts = contacts,
                        .bytes = n * sizeof(SphereInstance) + contacts * sizeof(SphereContact)};
  };
  return compute(
      search_, work(n * contacts_per_sphere_),
      [&](SphereCollider& collider) { return (collider.*find)(spheres); },
      [&](std::span<const Item> found) {
        const auto contacts = static_cast<double>(found.size());
        contacts_per_sphere_ = contacts / std::max(n, 1.0);
        return work(contacts);
      },
      [&] {
        return [find, kept = std::vector(spheres.begin(), spheres.end())](
                   SphereCollider& collider) { (collider.*find)(kept); };
      });
}

ContactSpan AutomaticSphereCollider::find_contacts(std::span<const SphereInstance> spheres) {
  return search(spheres, &SphereCollider::find_contacts);
}

std::span<const SpherePair> AutomaticSphereCollider::find_pairs(
    std::span<const SphereInstance> spheres) {
  return search(spheres, &SphereCollider::find_pairs);
}

std::span<const PairContact> AutomaticSphereCollider::find_touching(
    std::span<const SphereInstance> spheres, std::span<const SpherePair> pairs) {
  transferred_ = {};
  if (reuse_decision(given_, spheres.size(), pairs.size())) {
    return given_.by->find_touching(spheres, pairs);
  }
  const ColliderWork work = work_of(spheres, pairs);
  const auto found = compute(
      given_, work,
      [&](SphereCollider& collider) { return collider.find_touching(spheres, pairs); },
      [&](std::span<const PairContact>) { return work; },
      [&] {
        return [kept = std::vector(spheres.begin(), spheres.end()),
                kept_pairs = std::vector(pairs.begin(), pairs.end())](SphereCollider& collider) {
          collider.find_touching(kept, kept_pairs);
        };
      });
  transferred_ = given_.by->transferred();
  return found;
}

/// A collider with either algorithm can test given pairs. An existing collider is preferred, which
/// avoids a second thread pool or CUDA context.
SphereCollider& AutomaticSphereCollider::collider(Backend backend, SphereAlgorithm algorithm) {
  OfBackend& of_backend = colliders_[backend == Backend::cuda ? 1 : 0];
  if (algorithm == SphereAlgorithm::automatic) {
    algorithm = of_backend[0] ? SphereAlgorithm::all_pairs : SphereAlgorithm::grid;
  }
  std::unique_ptr<SphereCollider>& slot = of_backend[index_of(algorithm)];
  if (slot == nullptr) {
    SphereColliderOptions options = options_;
    options.backend = backend;
    options.algorithm = algorithm;
    slot = make_(options);
  }
  return *slot;
}

/// The other thread also repeats the current call, because the first call allocates device memory,
/// pins host memory and loads the kernels.
template <class KeepInput>
void AutomaticSphereCollider::start_device_if_it_pays(const Calls& calls,
                                                      const ColliderWork& expected,
                                                      const KeepInput& keep_input) {
  if (!starter_.is_due(search_.chooser.missed_us() + given_.chooser.missed_us())) return;
  if (options_.costs.cuda_start_ms == 0) {
    starter_.cancel();
    wake_device();
    return;
  }
  std::vector<Way> ways = calls.ways;
  std::erase_if(ways, [](const Way& way) { return way.backend != Backend::cuda; });
  const auto predicted_us = [&](const Way& way) { return microseconds(way.terms, expected); };
  const double least_us = predicted_us(*std::ranges::min_element(ways, {}, predicted_us));
  std::erase_if(ways, [&](const Way& way) { return predicted_us(way) > kMaxSlowdown * least_us; });
  starter_.start([make = make_, options = options_, ways, repeat = keep_input()]() mutable {
    OfBackend colliders;
    options.backend = Backend::cuda;
    for (const Way& way : ways) {
      const bool any = way.algorithm == SphereAlgorithm::automatic;
      options.algorithm = any ? SphereAlgorithm::grid : way.algorithm;
      auto& collider = colliders[index_of(options.algorithm)];
      collider = make(options);
      try {
        repeat(*collider);
      } catch (const InvalidArgument&) {  // also thrown to the caller
      }
    }
    return colliders;
  });
}

void AutomaticSphereCollider::take_started_device() {
  auto outcome = starter_.take();
  if (!outcome) return;
  if (outcome->has_failed) return give_up_device(outcome->failure);
  colliders_[1] = std::move(outcome->device);
  wake_device();
}

void AutomaticSphereCollider::wake_device() {
  for (Calls* calls : {&search_, &given_}) calls->chooser.wake();
}

void AutomaticSphereCollider::give_up_device(std::string_view failure) {
  device_failure_ = failure;
  device_lost_ = !failure.empty();
  for (auto& collider : colliders_[1]) collider.reset();
  for (Calls* calls : {&search_, &given_}) {
    for (std::size_t i = 0; i < calls->ways.size(); ++i) {
      if (calls->ways[i].backend == Backend::cuda) calls->chooser.remove(i);
    }
    calls->following = 0;  // the next call clears device_failure()
  }
}

}  // namespace JFPX_ABI
}  // namespace jfpx
