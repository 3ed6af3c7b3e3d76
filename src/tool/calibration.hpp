/// Measures what sphere collision costs on this machine.
#pragma once

#include <jfpx/cost_model.hpp>

#include <cstdint>
#include <functional>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

struct Calibration {
  CostModel costs;      ///< cuda: the defaults where it is not usable
  std::string no_cuda;  ///< why cuda was not measured; empty if it was
};

/// Takes seconds, one thread. `progress(done, total)` is called after each measurement.
Calibration calibrate(const std::function<void(std::uint64_t, std::uint64_t)>& progress);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
