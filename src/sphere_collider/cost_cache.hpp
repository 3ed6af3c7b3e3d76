/// The cost model of this machine, in the user's cache folder: what calibrated_costs() reads.
#pragma once

#include <jfpx/cost_model.hpp>

#include <string>

namespace jfpx {
inline namespace JFPX_ABI {

/// $XDG_CACHE_HOME/jfpx, or ~/.cache/jfpx, and a name for each precision; empty where the
/// environment names no home.
JFPX_API std::string cost_model_path();

/// Processor and cores, GPUs and driver. Does not start the GPU: it reads what the driver says in
/// /proc.
JFPX_API CostModelOrigin this_machine();

/// @throws FileError
JFPX_API void store_costs(const CostModel& costs);

}  // namespace JFPX_ABI
}  // namespace jfpx
