/// Where the camera stands at first.
#pragma once

#include "src/viewer/camera.hpp"
#include "src/viewer/options.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Sees all that moves, from the front, the right and above; a tower too tall for its bodies to be
/// seen is shown from its foot. --eye and --target go first.
Camera camera_for(const ViewOptions& options, const Scene& scene, const Moment& moment);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
