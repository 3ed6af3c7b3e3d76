/// Selection of the faster of two alternatives for tasks of any size, from measured times alone.
#pragma once

#include "src/base/time_chooser.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Has a TimeChooser for each number of bits of the size. The caller measures the times. The first
/// alternative is replaced only for a clear gain. Not thread-safe.
class SizedChooser {
 public:
  /// Selects the alternative for the next task, 0 or 1. @param size in any unit
  std::size_t choose(std::size_t size) {
    current_ = std::min<std::size_t>(choosers_.size() - 1, std::bit_width(size));
    predicted_us_ = kLeastUs * static_cast<double>(size);
    const std::array predicted{predicted_us_, predicted_us_};
    return choosers_[current_].choose(static_cast<double>(size), predicted).alternative;
  }
  /// Records the time [us] of the task for which choose() was last called. May be omitted.
  void record(double us) { choosers_[current_].record(us, predicted_us_); }

 private:
  /// [us] for a unit of the size: shorter than any possible time, so that both are measured.
  static constexpr double kLeastUs = 1e-4;

  std::vector<TimeChooser> choosers_ = std::vector(33, TimeChooser(2));
  std::size_t current_ = 0;  // of the last choice
  double predicted_us_ = 0;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
