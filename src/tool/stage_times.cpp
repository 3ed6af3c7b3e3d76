#include "src/tool/stage_times.hpp"

#include <fmt/format.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

StageTimes& StageTimes::operator+=(const StageTimes& other) {
  integrate += other.integrate;
  broad += other.broad;
  detect += other.detect;
  solve += other.solve;
  total += other.total;
  return *this;
}

StageTimes stage_times(const StepReport& report) {
  return {.integrate = report.integrate_ms,
          .broad = 0,
          .detect = report.detect_ms,
          .solve = report.resolve_ms,
          .total = report.total_ms};
}

std::string trouble_of(const StepReport& report) {
  if (!report.non_finite) return {};
  return fmt::format("step {}: body {} became non-finite; the state is frozen", report.step,
                     report.non_finite_body.index);
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
