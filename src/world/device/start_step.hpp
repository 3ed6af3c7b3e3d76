/// Start of a soft step on a device.
#pragma once

#include "src/world/device/step_data.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Resets the counters of the last step, without a barrier.
template <class Team>
JFPX_HD void start_counters(const Team& team, const StepData& data) {
  team.once([&] {
    static_cast<StepCounters&>(*data.counters) = {};
    data.counters->progress.started = 1;
  });
  team.for_each_nowait(data.parts * (kBins + 1), [&](std::uint32_t i) { data.bin_sizes[i] = 0; });
}

/// Saves the columns of a body that the step changes before it can fail.
JFPX_HD inline void save(const StepData& data, std::uint32_t body) {
  each_saved([body](auto* to, const auto* from) { to[body] = from[body]; }, data.saved,
             data.step.motion);
}

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
