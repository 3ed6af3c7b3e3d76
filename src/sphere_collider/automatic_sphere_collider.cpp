/// Backend::automatic: who computes is chosen call by call (thesis 5.4).
#include "src/sphere_collider/automatic_sphere_collider.hpp"

#include <jfpx/error.hpp>

#include <algorithm>
#include <chrono>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using Clock = std::chrono::steady_clock;

std::vector<CostChooser::Way> ways_to_search(const SphereColliderOptions& options, bool with_cuda) {
  using enum SphereAlgorithm;
  const CostModel& costs = options.costs;
  std::vector<CostChooser::Way> ways = {
      {Backend::cpu, all_pairs, costs.x86_all_pairs},
      {Backend::cpu, sorted_tiles, costs.x86_sorted_tiles},
      {Backend::cuda, all_pairs, costs.cuda_all_pairs, true},
      {Backend::cuda, sorted_tiles, costs.cuda_sorted_tiles, true},
  };
  std::erase_if(ways, [&](const CostChooser::Way& way) {
    return (way.backend == Backend::cuda && !with_cuda) ||
           (options.algorithm != automatic && options.algorithm != way.algorithm);
  });
  return ways;
}

std::vector<CostChooser::Way> ways_to_test(const SphereColliderOptions& options, bool with_cuda) {
  using enum SphereAlgorithm;
  std::vector<CostChooser::Way> ways = {{Backend::cpu, automatic, options.costs.x86_given_pairs}};
  if (with_cuda) ways.push_back({Backend::cuda, automatic, options.costs.cuda_given_pairs, true});
  return ways;
}

/// What given pairs take, the same for all results and for those that touch: what a pair costs
/// hardly depends on it.
ColliderWork work_of(std::span<const SphereInstance> spheres, std::span<const SpherePair> pairs) {
  const auto n = static_cast<double>(spheres.size()), m = static_cast<double>(pairs.size());
  return {.spheres = n,
          .pairs = m,
          .bytes = n * sizeof(SphereInstance) + m * (sizeof(SpherePair) + sizeof(PairResult))};
}

}  // namespace

AutomaticSphereCollider::AutomaticSphereCollider(const SphereColliderOptions& options,
                                                 SphereColliderMaker make, bool with_cuda)
    : options_(options),
      make_(std::move(make)),
      search_{CostChooser(ways_to_search(options, with_cuda))},
      given_{CostChooser(ways_to_test(options, with_cuda))},
      device_asleep_(with_cuda) {}

/// Whether the last decision holds for this call too: then calls.by does it.
bool AutomaticSphereCollider::goes_on(Calls& calls, std::size_t spheres, std::size_t pairs) {
  if (calls.following > 0 && spheres == calls.spheres && pairs == calls.pairs) {
    --calls.following;
    last_ = &calls;
    return true;
  }
  calls.spheres = spheres;
  calls.pairs = pairs;
  return false;
}

/// Calls `call` with the collider that is chosen, and with x86 if the device fails.
template <class Call, class Measure>
auto AutomaticSphereCollider::compute(Calls& calls, const ColliderWork& expected, const Call& call,
                                      const Measure& measure) {
  device_failure_.clear();
  calls.following = 0;
  start_device_if_it_pays();
  while (true) {
    const CostChooser::Decision decision = calls.chooser.choose(expected);
    const auto [backend, algorithm, terms, dormant] = calls.chooser.way(decision.way);
    try {
      calls.by = &collider(backend, algorithm);
      const Clock::time_point start = Clock::now();
      const auto result = call(*calls.by);
      const std::chrono::duration<double, std::micro> us = Clock::now() - start;
      calls.chooser.record(measure(result), us.count());
      if (device_failure_.empty()) calls.following = decision.following;
      calls.reason = device_lost_ ? ChoiceReason::device_failed : calls.chooser.reason();
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
  if (goes_on(search_, spheres.size(), 0)) return search_.by->find_contacts(spheres);
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

std::span<const PairResult> AutomaticSphereCollider::test_pairs(
    std::span<const SphereInstance> spheres, std::span<const SpherePair> pairs) {
  if (goes_on(given_, spheres.size(), pairs.size())) return given_.by->test_pairs(spheres, pairs);
  const ColliderWork work = work_of(spheres, pairs);
  return compute(
      given_, work, [&](SphereCollider& collider) { return collider.test_pairs(spheres, pairs); },
      [&](std::span<const PairResult>) { return work; });
}

std::span<const PairContact> AutomaticSphereCollider::find_touching(
    std::span<const SphereInstance> spheres, std::span<const SpherePair> pairs) {
  transferred_ = {};
  if (goes_on(given_, spheres.size(), pairs.size())) {
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

/// For given pairs any algorithm will do: the one that is there, so that no second pool of threads
/// and no second context is made for nothing.
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

/// The rule of who rents skis until the rent would have bought them: at most twice the cost of
/// having known.
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
    calls->chooser.remove(Backend::cuda);
    calls->following = 0;  // so that the next call tells that it did not fail
  }
}

}  // namespace JFPX_ABI
}  // namespace jfpx
