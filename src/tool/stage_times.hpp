/// Durations of the stages of a step, for all engines.
#pragma once

#include <jfpx/world.hpp>

#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

/// Duration of each stage of a step [ms].
struct StageTimes {
  double integrate = 0, broad = 0, detect = 0, solve = 0, total = 0;
  StageTimes& operator+=(const StageTimes& other);
};

/// Of a native step.
StageTimes stage_times(const StepReport& report);
/// Reason why a world can't continue meaningfully after a step; empty if it can.
std::string trouble_of(const StepReport& report);

/// Of a step of bullet::SceneWorld. @tparam BulletTimes bullet::StageTimes
template <class BulletTimes>
StageTimes stage_times_of_bullet(const BulletTimes& times) {
  return {.integrate = times.integrate,
          .broad = times.broadphase,
          .detect = times.dispatch,
          .solve = times.islands + times.solve,
          .total = times.total};
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
