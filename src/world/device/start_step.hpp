/// Start of a soft step on a device.
#pragma once

#include "src/world/device/step_data.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Resets the counters of the step before, without a barrier.
template <class Team>
JFPX_HD void start_counters(const Team& team, const StepData& data) {
  team.once([&] {
    static_cast<StepCounters&>(*data.counters) = {};
    data.counters->progress.started = 1;
  });
}

/// Saves what the step changes of a body before it can fail.
JFPX_HD inline void save(const StepData& data, std::uint32_t body) {
  const MotionPointers& motion = data.step.motion;
  data.saved.last_acceleration[body] = motion.last_acceleration[body];
  data.saved.mean_motion[body] = motion.mean_motion[body];
  data.saved.rest_time[body] = motion.rest_time[body];
  data.saved.awake[body] = motion.awake[body];
}

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
