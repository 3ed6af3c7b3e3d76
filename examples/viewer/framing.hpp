/// Where the camera stands at first.
#pragma once

#include "examples/viewer/camera.hpp"
#include "examples/viewer/options.hpp"

namespace jfpx::inline JFPX_ABI::view {

/// Sees all that moves, from the front, the right and above; a tower too tall for its bodies to be
/// seen is shown from its foot. --eye and --target go first.
Camera camera_for(const ViewOptions& options, const Scene& scene, const Moment& moment);

}  // namespace jfpx::inline JFPX_ABI::view
