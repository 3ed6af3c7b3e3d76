/// The uniform block shared by all shaders: shaders/frame.glsl.
#pragma once

#include "src/viewer/renderer.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

inline constexpr int kMaxTaps = 32;

/// Has the std140 layout.
struct FrameBlock {
  float view_projection[16];
  float light[16];
  float ray_x[4], ray_y[4], ray_z[4];
  float sun[4];
  float viewport[4];
  float shadow[4];
  float occlusion[4];
  float taps[kMaxTaps][4];
};

FrameBlock make_frame_block(const Drawing& drawing, const View& view, const Quality& quality,
                            const Viewport& viewport);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
