/// Turns wall time into whole steps.
#include "src/viewer/step_clock.hpp"

#include "src/viewer/timing.hpp"

#include <algorithm>
#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

constexpr double kMemory = 0.97;  // from one picture to the next

}  // namespace

void StepClock::advance(double seconds, double dt, std::uint64_t most,
                        const std::function<void()>& step) {
  const double asked = seconds > 0 && std::isfinite(seconds) ? seconds : 0;
  rest_ += asked;
  asked_ = asked_ * kMemory + asked;
  lost_ *= kMemory;
  Stopwatch watch;
  double spent = 0;
  for (std::uint64_t made = 0; rest_ >= dt && made < most; ++made) {
    if (made >= kSureSteps && (spent += watch.lap()) > patience) {
      lost_ += rest_;
      rest_ = 0;
      break;
    }
    step();
    rest_ -= dt;
  }
  share_ = std::min(rest_ / dt, 1.0);
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
