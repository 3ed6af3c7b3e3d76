/// Backend::automatic: selects backend and algorithm for each call (thesis 5.4).
#pragma once

#include <jfpx/sphere_collider.hpp>

#include "src/base/device_starter.hpp"
#include "src/base/time_chooser.hpp"

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Creates the collider for the backend and algorithm in the options.
using SphereColliderMaker =
    std::function<std::unique_ptr<SphereCollider>(const SphereColliderOptions&)>;

/// Forwards each call to one of up to four colliders (CPU and CUDA, with either algorithm), which
/// are created on first use. Starts the device when the accumulated time that it would have saved
/// reaches the cost of the start. The start runs on another thread while the CPU computes all
/// calls, or in the call if the cost is 0. If there is no device, the CPU computes all calls and no
/// failure is reported. If the device fails, also during its start, the CPU computes that call and
/// all later ones, and device_failure() reports it once. The destructor waits for the other thread.
class AutomaticSphereCollider final : public SphereCollider {
 public:
  /// `options.backend` is `automatic`; `with_cuda` states whether `make` supports CUDA.
  AutomaticSphereCollider(const SphereColliderOptions& options, SphereColliderMaker make,
                          bool with_cuda);

  ContactSpan find_contacts(std::span<const SphereInstance> spheres) override;
  std::span<const SpherePair> find_pairs(std::span<const SphereInstance> spheres) override;
  std::span<const PairContact> find_touching(std::span<const SphereInstance> spheres,
                                             std::span<const SpherePair> pairs) override;
  TransferredBytes transferred() const noexcept override { return transferred_; }
  Backend backend() const noexcept override { return last_->backend; }
  SphereAlgorithm algorithm() const noexcept override { return algorithm_; }
  ChoiceReason reason() const noexcept override { return last_->reason; }
  std::string_view device_failure() const noexcept override { return device_failure_; }

 private:
  /// A backend and algorithm that can compute a call, and their predicted cost.
  struct Way {
    Backend backend;
    SphereAlgorithm algorithm;
    CostTerms terms;
  };
  /// State of one kind of call: searches, or tests of given pairs.
  struct Calls {
    explicit Calls(std::vector<Way> ways_of_calls);

    std::vector<Way> ways;
    TimeChooser chooser;  ///< alternative i is ways[i]
    /// Number of following calls with the same counts that `by` computes without a new decision.
    int following = 0;
    std::size_t spheres = 0, pairs = 0;
    SphereCollider* by = nullptr;
    Backend backend = Backend::cpu;
    ChoiceReason reason = ChoiceReason::fixed;
  };

  using OfBackend = std::array<std::unique_ptr<SphereCollider>, 2>;  ///< by algorithm

  static std::vector<Way> ways_to_search(const SphereColliderOptions& options, bool with_cuda);
  static std::vector<Way> ways_to_test(const SphereColliderOptions& options, bool with_cuda);
  template <class Item>
  std::span<const Item> search(
      std::span<const SphereInstance> spheres,
      std::span<const Item> (SphereCollider::*find)(std::span<const SphereInstance>));
  template <class Call, class Measure, class KeepInput>
  auto compute(Calls& calls, const ColliderWork& expected, const Call& call, const Measure& measure,
               const KeepInput& keep_input);
  bool reuse_decision(Calls& calls, std::size_t spheres, std::size_t pairs);
  SphereCollider& collider(Backend backend, SphereAlgorithm algorithm);
  template <class KeepInput>
  void start_device_if_it_pays(const Calls& calls, const ColliderWork& expected,
                               const KeepInput& keep_input);
  /// Takes over the device if it has been started.
  void take_started_device();
  void wake_device();
  /// Removes CUDA from all later decisions. `failure` is empty if there is no device.
  void give_up_device(std::string_view failure);

  SphereColliderOptions options_;
  SphereColliderMaker make_;
  Calls search_, given_;
  const Calls* last_ = &search_;
  std::array<OfBackend, 2> colliders_;  ///< by backend
  double contacts_per_sphere_ = 1;      ///< in the last search that was measured
  bool device_lost_ = false;
  std::string device_failure_;
  TransferredBytes transferred_;
  SphereAlgorithm algorithm_ = SphereAlgorithm::automatic;
  DeviceStarter<OfBackend> starter_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
