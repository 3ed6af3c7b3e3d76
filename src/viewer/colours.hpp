/// Colours of bodies: by number, and by a value between 0 and 1.
#pragma once

#include "src/viewer/drawing.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// The colours of a set of pool balls, solid and striped in turn.
Paint ball_paint(std::uint32_t index);
/// Wood in slightly different tones.
Paint crate_paint(std::uint32_t index);
/// Dark blue over green to yellow, equally bright steps; values are clamped to [0, 1].
Paint scale_paint(Real value);
/// One of many hues, far from those of the numbers beside it.
Paint hue_paint(std::uint32_t number);
/// The paint in the dark: for bodies that sleep.
Paint dimmed(Paint paint);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
