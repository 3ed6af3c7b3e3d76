/// Conversion of wall time to fixed steps and a fraction of the next step.
#pragma once

#include <jfpx/config.hpp>

#include <cstdint>
#include <functional>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

class StepClock {
 public:
  /// Number of steps per picture that are computed even beyond the budget.
  static constexpr std::uint64_t kSureSteps = 8;

  /// Advances by `seconds` and computes the due steps of length `dt`, at most `max_steps`. Drops
  /// steps beyond the time budget, so that a slow machine shows slow motion instead of freezing.
  /// Negative and non-finite times count as zero.
  void advance(double seconds, double dt, std::uint64_t max_steps,
               const std::function<void()>& step);
  /// Position in the shown step, in [0, 1].
  double share() const { return share_; }
  /// Fraction of the recent time that was not dropped, in [0, 1].
  double kept() const { return elapsed_ > 0 ? 1 - dropped_ / elapsed_ : 1; }
  /// Moves to the end of the shown step.
  void settle() { rest_ = 0, share_ = 1; }

  double budget = 0.03;  ///< wall time for the steps of one picture [s]

 private:
  double rest_ = 0, share_ = 1;
  double elapsed_ = 0, dropped_ = 0;  ///< [s], exponentially weighted sums
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
