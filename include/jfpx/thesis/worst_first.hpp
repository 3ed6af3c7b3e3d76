/// Solver::worst_first, BroadPhase::hierarchy and BroadPhase::brute_force of a World: the parts of
/// the thesis that are in the library jfpx_thesis.
#pragma once

#include <jfpx/world.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace thesis {

/// Must be called once, before the first World that uses one of them is made, restored or replayed.
/// Further calls have no effect. May run concurrently with any function.
JFPX_API void enable() noexcept;

}  // namespace thesis
}  // namespace JFPX_ABI
}  // namespace jfpx
