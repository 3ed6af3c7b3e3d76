/// Forces on bodies, as arrows.
#pragma once

#include <jfpx/scene.hpp>

#include "src/viewer/drawing.hpp"
#include "src/viewer/moment.hpp"

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// What pushed each body in the step between two moments, its weight aside [N]: its mass times how
/// its velocity changed beyond its own acceleration. So a body at rest feels what holds it, one
/// that falls freely nothing, and any engine can be asked. Zero where there is no step between.
std::vector<Vec3> forces_between(const Scene& scene, const Moment& before, const Moment& now);

/// Adds an arrow with its tail at `from`.
void draw_arrow(const Vec3& from, const Vec3& way, Drawing* drawing);

/// Adds an arrow at each body. Twice as long is four times the force; as long as `unit` is the
/// weight of a typical body, or the largest force where nothing has weight. None is longer than
/// five units, nor drawn below a hundredth of the weight.
void draw_forces(const Scene& scene, const Moment& before, const Moment& now, Real unit,
                 Drawing* drawing);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
