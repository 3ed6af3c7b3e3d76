/// Conversion of wall time to fixed steps.
#include "src/viewer/step_clock.hpp"

#include "src/base/stopwatch.hpp"

#include <algorithm>
#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

constexpr double kDecay = 0.97;  // per picture

}  // namespace

void StepClock::advance(double seconds, double dt, std::uint64_t max_steps,
                        const std::function<void()>& step) {
  const double elapsed = seconds > 0 && std::isfinite(seconds) ? seconds : 0;
  rest_ += elapsed;
  elapsed_ = elapsed_ * kDecay + elapsed;
  dropped_ *= kDecay;
  Stopwatch watch;
  double spent = 0;
  for (std::uint64_t made = 0; rest_ >= dt && made < max_steps; ++made) {
    if (made >= kSureSteps && (spent += watch.lap()) > budget) {
      dropped_ += rest_;
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
