/// Measurement of the costs of sphere collision on this machine.
#pragma once

#include <jfpx/cost_model.hpp>

#include <cstdint>
#include <functional>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

struct Calibration {
  CostModel costs;      ///< defaults for cuda if it is not usable
  std::string no_cuda;  ///< reason why cuda was not measured; empty if it was
};

/// Takes a few seconds on one thread. Calls `progress(done, total)` after each measurement.
Calibration calibrate(const std::function<void(std::uint64_t, std::uint64_t)>& progress);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
