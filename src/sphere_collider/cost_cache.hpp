/// The cost model of this machine in the user's cache folder, which calibrated_costs() reads.
#pragma once

#include <jfpx/cost_model.hpp>

#include <string>

namespace jfpx {
inline namespace JFPX_ABI {

/// Returns the path of the file in $XDG_CACHE_HOME/jfpx or ~/.cache/jfpx. The name depends on the
/// precision. Empty if the environment defines neither folder.
JFPX_API std::string cost_model_path();

/// Returns processor, number of cores, GPUs and driver. Does not start the GPU: reads the driver's
/// files in /proc.
JFPX_API CostModelOrigin this_machine();

/// Writes the costs with this_machine() as their origin. @throws FileError
JFPX_API void store_costs(const CostModel& costs);

}  // namespace JFPX_ABI
}  // namespace jfpx
