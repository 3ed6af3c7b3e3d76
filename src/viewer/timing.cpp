/// Durations of steps and pictures for the summary of a run.
#include "src/viewer/timing.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 != 0 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
}

std::string Timing::text(bool rendering) const {
  std::string text = fmt::format("{} steps, {:.3f} ms each; ", steps_, median(step_ms_));
  if (!rendering) return text + "rendering off (median)";
  return text + fmt::format("rendering on: {} pictures, {:.3f} ms each (medians)",
                            picture_ms_.size(), median(picture_ms_));
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
