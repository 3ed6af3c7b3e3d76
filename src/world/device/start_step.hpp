/// Start of a soft step on a device.
#pragma once

#include "src/world/device/step_data.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Sets the parity and the sizes in the state of each part, without a barrier.
template <class Team>
JFPX_HD void start_state(const Team& team, const StepData& data) {
  team.team_of_part().once([&] {
    const Progress& progress = data.counters->progress;
    PartState& state = data.state();
    state.parity = static_cast<std::uint32_t>(progress.completed & 1);
    state.now = {};
    state.last = progress.contacts[1 - state.parity];
  });
}

/// Resets the counters of the last step, without a barrier.
template <class Team>
JFPX_HD void start_counters(const Team& team, const StepData& data) {
  team.once([&] {
    static_cast<StepCounters&>(*data.counters) = {};
    data.counters->progress.started = 1;
  });
  start_state(team, data);
  const auto of_part = team.team_of_part();
  PartState& state = data.state();
  of_part.once([&] {
    state.flat_candidates = state.other_candidates = state.full_tests = state.hiding = 0;
    state.bodies_with_manifolds = 0;
    for (std::uint32_t& count : state.inner_rows) count = 0;
    state.inner_points = state.points_of_rows = 0;
  });
  of_part.for_each_nowait(data.parts * (kBins + 1),
                          [&](std::uint32_t i) { state.bin_sizes[i] = 0; });
}

/// Saves the columns of a body that the step changes before it can fail.
JFPX_HD inline void save(const StepData& data, std::uint32_t body) {
  each_saved([body](auto* to, const auto* from) { to[body] = from[body]; }, data.saved,
             data.step.motion);
}

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
