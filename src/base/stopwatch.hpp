/// Measurement of wall time.
#pragma once

#include <jfpx/config.hpp>

#include <chrono>
#include <ratio>

namespace jfpx {
inline namespace JFPX_ABI {

/// Measures the wall time of consecutive laps. The first lap starts with the construction.
class Stopwatch {
 public:
  /// Ends the lap, and starts the next one. @returns the duration of the lap [s]
  double lap() { return end_lap<std::ratio<1>>(); }
  /// lap() in [ms].
  double lap_ms() { return end_lap<std::milli>(); }
  /// lap() in [us].
  double lap_us() { return end_lap<std::micro>(); }

 private:
  using Clock = std::chrono::steady_clock;

  template <class Unit>
  double end_lap() {
    const Clock::time_point now = Clock::now();
    const std::chrono::duration<double, Unit> duration = now - start_;
    start_ = now;
    return duration.count();
  }

  Clock::time_point start_ = Clock::now();
};

}  // namespace JFPX_ABI
}  // namespace jfpx
