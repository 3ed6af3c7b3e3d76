/// Backend::automatic: who computes is chosen call by call (thesis 5.4).
#pragma once

#include <jfpx/sphere_collider.hpp>

#include "src/sphere_collider/cost_chooser.hpp"

#include <functional>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {

/// Makes the collider of a backend and algorithm that options name.
using SphereColliderMaker =
    std::function<std::unique_ptr<SphereCollider>(const SphereColliderOptions&)>;

/// Hands each call to one of up to four colliders, x86 and CUDA with either algorithm, which are
/// made when they are first needed. The device is first touched when what it would have saved so
/// far is what touching it costs; where it can't be had, x86 stays, and nobody is told. When it
/// fails, x86 computes that call and all others: device_failure() tells once.
class AutomaticSphereCollider final : public SphereCollider {
 public:
  /// `options.backend` is `automatic`; `with_cuda` is whether `make` knows that backend.
  AutomaticSphereCollider(const SphereColliderOptions& options, SphereColliderMaker make,
                          bool with_cuda);

  ContactSpan find_contacts(std::span<const SphereInstance> spheres) override;
  std::span<const PairResult> test_pairs(std::span<const SphereInstance> spheres,
                                         std::span<const SpherePair> pairs) override;
  std::span<const PairContact> find_touching(std::span<const SphereInstance> spheres,
                                             std::span<const SpherePair> pairs) override;
  TransferredBytes transferred() const noexcept override { return transferred_; }
  Backend backend() const noexcept override { return last_->backend; }
  SphereAlgorithm algorithm() const noexcept override { return algorithm_; }
  ChoiceReason reason() const noexcept override { return last_->reason; }
  std::string_view device_failure() const noexcept override { return device_failure_; }

 private:
  /// Calls of one kind: who is to do them.
  struct Calls {
    CostChooser chooser;
    // While these last, x86 does calls with the same counts without a further thought.
    int following = 0;
    std::size_t spheres = 0, pairs = 0;
    SphereCollider* by = nullptr;
    Backend backend = Backend::cpu;
    ChoiceReason reason = ChoiceReason::fixed;
  };

  template <class Call, class Measure>
  auto compute(Calls& calls, const ColliderWork& expected, const Call& call,
               const Measure& measure);
  bool goes_on(Calls& calls, std::size_t spheres, std::size_t pairs);
  SphereCollider& collider(Backend backend, SphereAlgorithm algorithm);
  void start_device_if_it_pays();
  /// `failure` is empty where there never was one.
  void give_up_device(std::string_view failure);

  SphereColliderOptions options_;
  SphereColliderMaker make_;
  Calls search_, given_;
  const Calls* last_ = &search_;
  std::unique_ptr<SphereCollider> colliders_[2][2];  ///< by backend and algorithm
  double contacts_per_sphere_ = 1;                   ///< in the last search that was decided alone
  bool device_asleep_;
  bool device_lost_ = false;
  std::string device_failure_;
  TransferredBytes transferred_;
  SphereAlgorithm algorithm_ = SphereAlgorithm::automatic;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
