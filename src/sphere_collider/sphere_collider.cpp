/// Creation of sphere colliders: validates the options and selects the backend.
#include <jfpx/error.hpp>
#include <jfpx/sphere_collider.hpp>

#include "src/base/reserve.hpp"
#include "src/base/thread_pool.hpp"
#include "src/sphere_collider/automatic_sphere_collider.hpp"
#include "src/sphere_collider/backend_table.hpp"
#include "src/sphere_collider/cost_model.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

std::unique_ptr<SphereCollider> make_named(const SphereColliderOptions& options, ThreadPool* pool) {
  const BackendRow& row = backend_row(options.backend);
  const BackendStatus status = row.probe();
  if (!status.usable) {
    throw BackendUnavailable(std::string(to_string(options.backend)) + ": " + status.reason);
  }
  return row.make_sphere_collider(options, pool);
}

}  // namespace

SphereCollider::~SphereCollider() = default;

std::span<const SpherePair> SphereCollider::find_pairs(std::span<const SphereInstance> spheres) {
  const ContactSpan contacts = find_contacts(spheres);
  resize_geometric(&pairs_of_contacts_, contacts.size());
  std::ranges::transform(contacts, pairs_of_contacts_.begin(), [](const SphereContact& c) {
    return SpherePair{c.a, c.b};
  });
  return pairs_of_contacts_;
}

std::unique_ptr<SphereCollider> make_sphere_collider(const SphereColliderOptions& options) {
  return make_sphere_collider(options, nullptr);
}

std::unique_ptr<SphereCollider> make_sphere_collider(const SphereColliderOptions& options,
                                                     ThreadPool* pool) {
  ThreadPool::check(options.threads);
  if (options.algorithm > SphereAlgorithm::grid) {
    throw InvalidArgument("algorithm is not a value of SphereAlgorithm");
  }
  if (options.simd > SimdLevel::avx512) throw InvalidArgument("simd is not a value of SimdLevel");
  const std::string fault = find_fault(options.costs);
  if (!fault.empty()) throw InvalidArgument("costs: " + fault);
  if (options.backend != Backend::automatic) return make_named(options, pool);
  const auto make = [pool](const SphereColliderOptions& named) { return make_named(named, pool); };
  return std::make_unique<AutomaticSphereCollider>(options, make,
                                                   backend_row(Backend::cuda).compiled);
}

std::string_view to_string(SphereAlgorithm algorithm) noexcept {
  switch (algorithm) {
    case SphereAlgorithm::automatic:
      return "automatic";
    case SphereAlgorithm::all_pairs:
      return "all pairs";
    case SphereAlgorithm::grid:
      return "grid";
  }
  return "unknown";
}

std::string_view to_string(ChoiceReason reason) noexcept {
  switch (reason) {
    case ChoiceReason::fixed:
      return "fixed";
    case ChoiceReason::predicted:
      return "predicted";
    case ChoiceReason::measured:
      return "measured";
    case ChoiceReason::kept:
      return "kept";
    case ChoiceReason::trial:
      return "trial";
    case ChoiceReason::device_failed:
      return "device failed";
  }
  return "unknown";
}

}  // namespace JFPX_ABI
}  // namespace jfpx
