/// Test double of a device collider: computes on the CPU, reports Backend::cuda, and fails on
/// request.
#pragma once

#include <jfpx/error.hpp>
#include <jfpx/sphere_collider.hpp>

#include "src/sphere_collider/automatic_sphere_collider.hpp"

#include <functional>
#include <memory>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// State of the simulated device, shared by its colliders.
struct Device {
  std::function<void()> before_call = [] {};  ///< may throw
  std::function<void()> when_made = [] {};    ///< may throw
  int made = 0, alive = 0, calls = 0;
};

class DeviceDouble final : public SphereCollider {
 public:
  DeviceDouble(Device* device, SphereAlgorithm algorithm)
      : device_(device),
        cpu_(make_sphere_collider({.backend = Backend::cpu, .algorithm = algorithm})) {
    ++device_->made;
    device_->when_made();
    ++device_->alive;
  }
  ~DeviceDouble() override { --device_->alive; }

  ContactSpan find_contacts(std::span<const SphereInstance> spheres) override {
    ++device_->calls;
    device_->before_call();
    return cpu_->find_contacts(spheres);
  }
  std::span<const PairContact> find_touching(std::span<const SphereInstance> spheres,
                                             std::span<const SpherePair> pairs) override {
    ++device_->calls;
    device_->before_call();
    return cpu_->find_touching(spheres, pairs);
  }
  Backend backend() const noexcept override { return Backend::cuda; }
  SphereAlgorithm algorithm() const noexcept override { return cpu_->algorithm(); }

 private:
  Device* device_;
  std::unique_ptr<SphereCollider> cpu_;
};

/// Makes CPU colliders, and test doubles for cuda.
inline SphereColliderMaker maker_with(Device* device) {
  return [device](const SphereColliderOptions& options) -> std::unique_ptr<SphereCollider> {
    if (options.backend != Backend::cuda) return make_sphere_collider(options);
    return std::make_unique<DeviceDouble>(device, options.algorithm);
  };
}

/// Options whose costs state that the device has been started and takes no time.
inline SphereColliderOptions device_wins() {
  SphereColliderOptions options;
  options.costs.cuda_all_pairs = options.costs.cuda_grid = {};
  options.costs.cuda_given_pairs = {};
  options.costs.cuda_start_ms = 0;
  return options;
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
