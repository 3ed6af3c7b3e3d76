/// Backend::automatic of a world: selects the CPU or the device for each step.
#pragma once

#include <jfpx/cost_model.hpp>

#include "src/base/device_starter.hpp"
#include "src/base/time_chooser.hpp"
#include "src/sphere_collider/choice_reason.hpp"
#include "src/world/device/device_world.hpp"

#include <array>
#include <functional>
#include <memory>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {

/// Starts the device when the accumulated time that it would have saved reaches the cost of the
/// start. The start runs on another thread while the CPU performs the steps, or in the call if the
/// cost is 0. The destructor waits for that thread. Not thread-safe.
class AutomaticDevice {
 public:
  using Maker = std::function<std::unique_ptr<DeviceWorld>()>;

  /// @param make creates a warm device; called once, possibly on another thread
  AutomaticDevice(const CostModel& costs, Maker make);

  /// Returns the device once, after it has started; otherwise null.
  /// @param failure receives the reason if the start fails, but not if there is no device
  std::unique_ptr<DeviceWorld> take_started(std::string* failure);
  /// Whether the device, which take_started() has returned, should perform the next step.
  bool choose(std::size_t bodies);
  /// Records the time of the step for which choose() was last called.
  void record(double us);
  /// Selects the CPU for all later steps.
  void give_up();
  /// Reason for the last choice.
  ChoiceReason reason() const noexcept { return to_choice_reason(chooser_.reason()); }

 private:
  enum Way : std::size_t { kCpu, kDevice, kWays };

  CostTerms terms_[kWays];
  Maker make_;
  TimeChooser chooser_;
  std::array<double, kWays> predicted_us_{};
  std::size_t chosen_ = kCpu;
  DeviceStarter<std::unique_ptr<DeviceWorld>> starter_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
