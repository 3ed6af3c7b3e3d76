/// Colours of bodies by index and by a value in [0, 1].
#pragma once

#include "src/viewer/drawing.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Colour of a pool ball, solid or striped.
Paint ball_paint(std::uint32_t index);
/// Wood in one of several tones.
Paint crate_paint(std::uint32_t index);
/// Perceptually uniform colour map from dark blue over green to yellow; clamps to [0, 1].
Paint scale_paint(Real value);
/// One of many hues; neighbouring numbers have distant hues.
Paint hue_paint(std::uint32_t number);
/// Darker paint, for sleeping bodies.
Paint dimmed(Paint paint);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
