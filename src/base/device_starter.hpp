/// Start of a device on another thread when it pays off.
#pragma once

#include <jfpx/error.hpp>

#include <chrono>
#include <exception>
#include <future>
#include <new>
#include <optional>
#include <string>
#include <system_error>

namespace jfpx {
inline namespace JFPX_ABI {

/// Starts a device once, while the CPU continues to work. The destructor waits for the other
/// thread. Not thread-safe.
/// @tparam Device a movable, default-constructible handle
template <class Device>
class DeviceStarter {
 public:
  /// Outcome of a start.
  struct Outcome {
    Device device{};
    bool has_failed = false;
    std::string failure{};  ///< also empty if there is no device, which is not a failure
  };

  /// @param cost_us [us] of a start; 0: take() starts the device in the calling thread
  explicit DeviceStarter(double cost_us) : cost_us_(cost_us) {}

  /// Whether start() should be called: the break-even rule of the ski rental problem, which costs
  /// at most twice as much as the optimal decision made in hindsight.
  /// @param missed_us [us] that the device would have saved so far
  bool is_due(double missed_us) const { return !is_started_ && missed_us >= cost_us_; }
  /// Disables later starts.
  void cancel() noexcept { is_started_ = true; }
  /// Starts the device. @param make returns the device, after its first call if that is slow
  template <class Make>
  void start(Make make) {
    is_started_ = true;
    try {
      starting_ =
          std::async(cost_us_ > 0 ? std::launch::async : std::launch::deferred, std::move(make));
    } catch (const std::system_error&) {  // no thread could be created
      starting_ = unavailable();
    } catch (const std::bad_alloc&) {
      starting_ = unavailable();
    }
  }
  /// Returns the outcome of start() once, as soon as it is available.
  std::optional<Outcome> take() {
    if (!starting_.valid()) return std::nullopt;
    if (starting_.wait_for(std::chrono::seconds(0)) == std::future_status::timeout) {
      return std::nullopt;
    }
    try {
      return Outcome{.device = starting_.get()};
    } catch (const BackendUnavailable&) {
      return Outcome{.has_failed = true};
    } catch (const std::exception& error) {
      return Outcome{.has_failed = true, .failure = error.what()};
    }
  }

 private:
  static std::future<Device> unavailable() {
    std::promise<Device> promise;
    promise.set_exception(std::make_exception_ptr(BackendUnavailable("no thread")));
    return promise.get_future();
  }

  double cost_us_;
  bool is_started_ = false;
  std::future<Device> starting_;  ///< valid from start() until take() returns the outcome
};

}  // namespace JFPX_ABI
}  // namespace jfpx
