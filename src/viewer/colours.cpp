/// Colours of bodies by index and by a value in [0, 1].
#include "src/viewer/colours.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

Paint ball_paint(std::uint32_t index) {
  static constexpr std::array<Paint, 8> kPool = {{{232, 178, 36},
                                                  {30, 84, 168},
                                                  {204, 44, 40},
                                                  {98, 52, 138},
                                                  {228, 106, 34},
                                                  {22, 118, 78},
                                                  {134, 30, 42},
                                                  {34, 34, 38}}};
  // Hashed, so that neighbouring indices differ in colour and pattern.
  const std::uint32_t scattered = (index * 2654435761u) >> 8;
  Paint paint = kPool[scattered % kPool.size()];
  paint.pattern = (scattered >> 5) % 5 < 2 ? Pattern::striped_ball : Pattern::solid_ball;
  return paint;
}

Paint crate_paint(std::uint32_t index) {
  const std::uint32_t tone = ((index * 2654435761u) >> 12) % 5;
  const auto shade = [tone](unsigned base) { return static_cast<std::uint8_t>(base - 7 * tone); };
  return {shade(196), shade(150), shade(96), Pattern::crate};
}

Paint scale_paint(Real value) {
  // Five points of the colour map viridis (van der Walt and Smith).
  static constexpr std::array<Paint, 5> kPoints = {
      {{68, 1, 84}, {59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {253, 231, 37}}};
  const Real at = value > 0 ? std::min(value, Real(1)) * 4 : 0;  // also for NaN
  const auto i = static_cast<std::size_t>(std::min(at, Real(3)));
  const Real share = at - static_cast<Real>(i);
  const auto mix = [share](std::uint8_t a, std::uint8_t b) {
    return static_cast<std::uint8_t>(static_cast<Real>(a) * (1 - share) +
                                     static_cast<Real>(b) * share + Real(0.5));
  };
  const Paint &a = kPoints[i], &b = kPoints[i + 1];
  return {mix(a.r, b.r), mix(a.g, b.g), mix(a.b, b.b), Pattern::plain};
}

Paint hue_paint(std::uint32_t number) {
  // Multiples of the golden ratio modulo 1 are well separated (Knuth 1998, 6.4).
  const float hue = static_cast<float>(number * 2654435769u) * 0x1p-32f * 6;
  const auto channel = [hue](float at) {
    const float from_peak = std::fabs(std::fmod(hue + at, 6.0f) - 3);
    return static_cast<std::uint8_t>(62 + 178 * std::clamp(from_peak - 1, 0.0f, 1.0f));
  };
  return {channel(0), channel(4), channel(2), Pattern::plain};
}

Paint dimmed(Paint paint) {
  const auto dim = [](std::uint8_t c) { return static_cast<std::uint8_t>(c * 9 / 16 + 12); };
  return {dim(paint.r), dim(paint.g), dim(paint.b), paint.pattern};
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
