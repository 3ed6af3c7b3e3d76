/// Turns wall time into whole steps and the share of the next one.
#pragma once

#include <jfpx/config.hpp>

#include <cstdint>
#include <functional>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

class StepClock {
 public:
  /// So many steps are made for one picture however long they take.
  static constexpr std::uint64_t kSureSteps = 8;

  /// Makes the steps of `dt` that are due after `seconds` more, `most` of them at most. Those that
  /// `patience` has not sufficed for are given up: a machine that is too slow shows slow motion
  /// instead of freezing. Bad times count as none.
  void advance(double seconds, double dt, std::uint64_t most, const std::function<void()>& step);
  /// How far into the step that is shown: 0 to 1.
  double share() const { return share_; }
  /// Which share of the time of late was not given up: 0 to 1.
  double kept() const { return asked_ > 0 ? 1 - lost_ / asked_ : 1; }
  /// Shows the step that is shown, whole.
  void settle() { rest_ = 0, share_ = 1; }

  double patience = 0.03;  ///< [s] of wall clock for the steps of one picture

 private:
  double rest_ = 0, share_ = 1;
  double asked_ = 0, lost_ = 0;  ///< [s]; what is long past fades
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
