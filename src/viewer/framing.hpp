/// Initial position of the camera.
#pragma once

#include "src/viewer/camera.hpp"
#include "src/viewer/options.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// A camera that shows all movable bodies from the front, the right and above, or only the lower
/// part of a tower that is too tall for visible bodies. It is higher where meshes would hide
/// bodies.
/// --eye and --target take precedence.
Camera initial_camera(const ViewOptions& options, const Scene& scene, const RunState& run_state);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
