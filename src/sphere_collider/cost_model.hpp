/// Internal functions on cost models, for the library and the command.
#pragma once

#include <jfpx/cost_model.hpp>

#include <string>

namespace jfpx {
inline namespace JFPX_ABI {

/// Returns a message about the first term that is not finite or < 0; empty if all are valid.
JFPX_API std::string find_fault(const CostModel& model);

/// Returns the contents of the file that save_cost_model() writes.
JFPX_API std::string to_json(const MeasuredCostModel& model);

}  // namespace JFPX_ABI
}  // namespace jfpx
