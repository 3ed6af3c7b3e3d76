/// Enables Solver::worst_first in a test program or a benchmark.
#include <jfpx/thesis/worst_first.hpp>

namespace {
[[maybe_unused]] const bool thesis_is_enabled = (jfpx::thesis::enable(), true);
}  // namespace
