/// Durations of steps and pictures for the summary of a run, which compares rendering on and off as
/// in the thesis.
#pragma once

#include <jfpx/config.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

class Timing {
 public:
  /// @param count number of steps with this mean duration
  void add_step(double ms, std::uint64_t count = 1) {
    step_ms_.push_back(ms);
    steps_ += count;
  }
  void add_picture(double ms) { picture_ms_.push_back(ms); }
  /// "120 steps, 0.123 ms each; rendering on: 120 pictures, 4.567 ms each (medians)"
  std::string text(bool rendering) const;

 private:
  std::vector<double> step_ms_, picture_ms_;
  std::uint64_t steps_ = 0;
};

/// The median; for an even number of values, the mean of the two middle values; 0 without values.
double median(std::vector<double> values);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
