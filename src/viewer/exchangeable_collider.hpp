/// A collider that can be exchanged while its owner lives.
#pragma once

#include <jfpx/sphere_collider.hpp>

#include "src/viewer/run.hpp"

#include <memory>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// With the costs that `jfpx calibrate` has measured on this machine, if it has.
inline SphereColliderOptions collider_options(const EngineChoice& choice) {
  SphereColliderOptions options;
  options.backend = choice.backend;
  options.threads = choice.threads;
  if (choice.backend == Backend::automatic) options.costs = calibrated_costs().costs;
  return options;
}

/// All colliders give the same bits, so a run can't tell.
class ExchangeableCollider final : public SphereCollider {
 public:
  explicit ExchangeableCollider(std::unique_ptr<SphereCollider> first) : now_(std::move(first)) {}
  void exchange(std::unique_ptr<SphereCollider> next) { now_ = std::move(next); }

  ContactSpan find_contacts(std::span<const SphereInstance> spheres) override {
    return now_->find_contacts(spheres);
  }
  std::span<const PairResult> test_pairs(std::span<const SphereInstance> spheres,
                                         std::span<const SpherePair> pairs) override {
    return now_->test_pairs(spheres, pairs);
  }
  Backend backend() const noexcept override { return now_->backend(); }
  SphereAlgorithm algorithm() const noexcept override { return now_->algorithm(); }

 private:
  std::unique_ptr<SphereCollider> now_;
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
