/// What only the library and the command need of cost models.
#pragma once

#include <jfpx/cost_model.hpp>

#include <string>

namespace jfpx {
inline namespace JFPX_ABI {

/// The first term that is not finite or < 0, as a sentence; empty if all are good.
JFPX_API std::string find_fault(const CostModel& model);

/// The content of the file that save_cost_model() writes.
JFPX_API std::string to_json(const MeasuredCostModel& model);

}  // namespace JFPX_ABI
}  // namespace jfpx
