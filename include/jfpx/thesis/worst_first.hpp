/// Parts of the thesis in the library jfpx_thesis: Solver::worst_first, BroadPhase::hierarchy and
/// BroadPhase::brute_force of a World.
#pragma once

#include <jfpx/world.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace thesis {

/// Must be called once, before the first World that uses one of them is created, restored or
/// replayed. Further calls have no effect. May run concurrently with any function.
JFPX_THESIS_API void enable() noexcept;

}  // namespace thesis
}  // namespace JFPX_ABI
}  // namespace jfpx
