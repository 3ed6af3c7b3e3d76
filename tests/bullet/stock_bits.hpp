/// Runs random worlds for solvers beside stock ones and expects the same bits.
#pragma once

#include "tests/bullet/solver_world.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// World-steps that a test of a solver makes: JFPX_TEST_WORLD_STEPS, or as many as fit.
std::uint64_t wanted_solver_steps();

/// Runs random worlds with these parts beside stock ones. A failure is shrunk and printed.
SolverTotals expect_stocks_bits(std::uint64_t steps, MakeParts parts, MakeDispatcher dispatcher);

/// A heap with more rows than threads and vectors can share badly; in the middle of its steps
/// contact and friction begin to take turns.
SolverWorld make_large_heap(std::uint64_t seed);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
