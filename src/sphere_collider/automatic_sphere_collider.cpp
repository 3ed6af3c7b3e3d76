/// Backend::automatic: selects backend and algorithm for each call (thesis 5.4).
#include "src/sphere_collider/automatic_sphere_collider.hpp"

#include <jfpx/error.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using Clock = std::chrono::steady_clock;

/// Work of find_touching(). The bytes are those of the first call with a list whose pairs all
/// touch, because the changes and the touching pairs are unknown before the call.
ColliderWork work_of(std::span<const SphereInstance> spheres, std::span<const SpherePair> pairs) {
  const auto n = static_cast<double>(spheres.size()), m = static_cast<double>(pairs.size());
  return {.spheres = n,
          .pairs = m,
          .bytes = n * sizeof(SphereInstance) + m * (sizeof(SpherePair) + sizeof(PairContact))};
}

ChoiceReason choice_reason(TimeChooser::Reason reason) {
  switch (reason) {
    case TimeChooser::Reason::fixed:
      return ChoiceReason::fixed;
    case TimeChooser::Reason::predicted:
      return ChoiceReason::predicted;
    case TimeChooser::Reason::measured:
      return ChoiceReason::measured;
    case TimeChooser::Reason::kept:
      return ChoiceReason::kept;
    case TimeChooser::Reason::trial:
      return ChoiceReason::trial;
  }
  return ChoiceReason::fixed;
}

}  // namespace

AutomaticSphereCollider::Calls::Calls(std::vector<Way> ways_of_calls)
    : ways(std::move(ways_of_calls)), chooser([this] {
        std::vector<TimeChooser::Alternative> alternatives;
        for (const Way& way : ways) {
          // No call of a device is short enough to share a decision.
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
      {Backend::cpu, all_pairs, costs.x86_all_pairs},
      {Backend::cpu, sorted_tiles, costs.x86_sorted_tiles},
      {Backend::cuda, all_pairs, costs.cuda_all_pairs},
      {Backend::cuda, sorted_tiles, costs.cuda_sorted_tiles},
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
  std::vector<Way> ways = {{Backend::cpu, automatic, options.costs.x86_given_pairs}};
  if (with_cuda) ways.push_back({Backend::cuda, automatic, options.costs.cuda_given_pairs});
  return ways;
}

AutomaticSphereCollider::AutomaticSphereCollider(const SphereColliderOptions& options,
                                                 SphereColliderMaker make, bool with_cuda)
    : options_(options),
      make_(std::move(make)),
      search_(ways_to_search(options, with_cuda)),
      given_(ways_to_test(options, with_cuda)),
      device_asleep_(with_cuda) {}

/// Whether the last decision also covers this call; then `calls.by` computes it.
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

/// Executes `call` with the selected collider, and with the CPU if the device fails.
template <class Call, class Measure>
auto AutomaticSphereCollider::compute(Calls& calls, const ColliderWork& expected, const Call& call,
                                      const Measure& measure) {
  device_failure_.clear();
  calls.following = 0;
  start_device_if_it_pays();
  std::array<double, TimeChooser::kMaxAlternatives> predicted_us{};
  std::ranges::transform(calls.ways, predicted_us.begin(),
                         [&](const Way& way) { return microseconds(way.terms, expected); });
  while (true) {
    const auto decision =
        calls.chooser.choose(expected.pairs, std::span(predicted_us).first(calls.ways.size()));
    const auto& [backend, algorithm, terms] = calls.ways[decision.alternative];
    try {
      calls.by = &collider(backend, algorithm);
      const Clock::time_point start = Clock::now();
      const auto result = call(*calls.by);
      const std::chrono::duration<double, std::micro> us = Clock::now() - start;
      calls.chooser.record(us.count(), microseconds(terms, measure(result)));
      if (device_failure_.empty()) calls.following = decision.following;
      calls.reason =
          device_lost_ ? ChoiceReason::device_failed : choice_reason(calls.chooser.reason());
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

ContactSpan AutomaticSphereCollider::find_contacts(std::span<const SphereInstance> spheres) {
  if (reuse_decision(search_, spheres.size(), 0)) return search_.by->find_contacts(spheres);
  const auto n = static_cast<double>(spheres.size());
  const auto work = [&](double contacts) {
    return ColliderWork{.spheres = n,
                        .pairs = n * (n - 1) / 2,
                        .contacts = contacts,
                        .bytes = n * sizeof(SphereInstance) + contacts * sizeof(SphereContact)};
  };
  return compute(
      search_, work(n * contacts_per_sphere_),
      [&](SphereCollider& collider) { return collider.find_contacts(spheres); },
      [&](ContactSpan found) {
        const auto contacts = static_cast<double>(found.size());
        contacts_per_sphere_ = contacts / std::max(n, 1.0);
        return work(contacts);
      });
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
      [&](std::span<const PairContact>) { return work; });
  transferred_ = given_.by->transferred();
  return found;
}

/// Given pairs can be tested by a collider with either algorithm. An existing one is preferred, so
/// that no second thread pool or CUDA context is made.
SphereCollider& AutomaticSphereCollider::collider(Backend backend, SphereAlgorithm algorithm) {
  auto& of_backend = colliders_[backend == Backend::cuda ? 1 : 0];
  if (algorithm == SphereAlgorithm::automatic) {
    algorithm = of_backend[0] ? SphereAlgorithm::all_pairs : SphereAlgorithm::sorted_tiles;
  }
  std::unique_ptr<SphereCollider>& slot =
      of_backend[algorithm == SphereAlgorithm::all_pairs ? 0 : 1];
  if (slot == nullptr) {
    SphereColliderOptions options = options_;
    options.backend = backend;
    options.algorithm = algorithm;
    slot = make_(options);
  }
  return *slot;
}

/// The break-even rule of the ski rental problem: costs at most twice as much as the optimal
/// decision made in hindsight.
void AutomaticSphereCollider::start_device_if_it_pays() {
  if (!device_asleep_) return;
  if (search_.chooser.missed_us() + given_.chooser.missed_us() < 1e3 * options_.costs.cuda_start_ms)
    return;
  device_asleep_ = false;
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
