/// The cost model of this machine, in the user's cache folder.
#pragma once

#include <jfpx/cost_model.hpp>

#include <string>

namespace jfpx::inline JFPX_ABI::tool {

/// $XDG_CACHE_HOME/jfpx, or ~/.cache/jfpx, and a name for each precision; empty where the
/// environment names no home.
std::string cost_model_path();

/// Processor and cores, GPUs and driver. Does not start the GPU: it reads what the driver says in
/// /proc.
CostModelOrigin this_machine();

struct CachedCosts {
  CostModel costs;      ///< the defaults unless `problem` is empty
  std::string problem;  ///< why the file was not used: one line
};
/// Never fails: a file that is missing, broken or of another machine, driver or version is ignored.
CachedCosts load_cached_costs();

/// @throws FileError
void store_costs(const CostModel& costs);

}  // namespace jfpx::inline JFPX_ABI::tool
