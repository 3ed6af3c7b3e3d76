/// A sphere collider that delegates to a replaceable one.
#pragma once

#include <jfpx/sphere_collider.hpp>
#include <jfpx/world.hpp>

#include "src/viewer/run.hpp"

#include <memory>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Options with the costs measured by `jfpx calibrate` on this machine, or the default costs.
inline SphereColliderOptions collider_options(const EngineChoice& choice) {
  SphereColliderOptions options;
  options.backend = choice.backend;
  options.threads = choice.threads;
  if (choice.backend == Backend::automatic) options.costs = calibrated_costs().costs;
  return options;
}

inline WorldSettings world_settings(const EngineChoice& choice) {
  WorldSettings settings{.collider = collider_options(choice), .threads = choice.threads};
  settings.collider.threads = 1;
  return settings;
}

/// Delegates to a collider that can be replaced during the lifetime of the owner. All colliders
/// return identical bits, so a replacement does not change the run.
class ExchangeableCollider final : public SphereCollider {
 public:
  explicit ExchangeableCollider(std::unique_ptr<SphereCollider> first) : now_(std::move(first)) {}
  void exchange(std::unique_ptr<SphereCollider> next) { now_ = std::move(next); }

  ContactSpan find_contacts(std::span<const SphereInstance> spheres) override {
    return now_->find_contacts(spheres);
  }
  std::span<const PairContact> find_touching(std::span<const SphereInstance> spheres,
                                             std::span<const SpherePair> pairs) override {
    return now_->find_touching(spheres, pairs);
  }
  TransferredBytes transferred() const noexcept override { return now_->transferred(); }
  Backend backend() const noexcept override { return now_->backend(); }
  SphereAlgorithm algorithm() const noexcept override { return now_->algorithm(); }

 private:
  std::unique_ptr<SphereCollider> now_;
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
