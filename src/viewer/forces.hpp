/// Forces on bodies, drawn as arrows.
#pragma once

#include <jfpx/scene.hpp>

#include "src/viewer/drawing.hpp"
#include "src/viewer/run_state.hpp"

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Mean force on each body in the step between two states of a run, without its weight [N]: the
/// mass times the change of velocity, minus the part due to the body's own acceleration. It is the
/// supporting force for a body at rest, and zero for a freely falling body. The definition is
/// independent of the engine. Zero if there is no step between the states of a run.
std::vector<Vec3> forces_between(const Scene& scene, const RunState& before, const RunState& now);

/// Adds an arrow with its tail at `from`.
void draw_arrow(const Vec3& from, const Vec3& way, Drawing* drawing);

/// Adds an arrow at each body. Its length is proportional to the square root of the force; `unit`
/// is the length for the weight of a typical body, or for the largest force if no body has weight.
/// The length is limited to five units; forces below a hundredth of the reference are omitted.
void draw_forces(const Scene& scene, const RunState& before, const RunState& now, Real unit,
                 Drawing* drawing);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
