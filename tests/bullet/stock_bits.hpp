/// Runs random solver worlds together with stock Bullet and expects the same bits.
#pragma once

#include "tests/bullet/solver_world.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Number of world steps of a solver test: JFPX_TEST_WORLD_STEPS, or a default.
std::uint64_t wanted_solver_steps();

/// Runs random worlds with these components and with those of stock Bullet. Shrinks and prints a
/// failure.
SolverTotals expect_stocks_bits(std::uint64_t steps, MakeParts parts, MakeDispatcher dispatcher);

/// A heap with enough rows for several threads and full vectors. After half of its steps the solver
/// mode changes to solve the friction of each contact directly after the contact.
SolverWorld make_large_heap(std::uint64_t seed);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
