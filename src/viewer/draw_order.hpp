/// In which order spheres are drawn.
#pragma once

#include "src/viewer/camera.hpp"
#include "src/viewer/drawing.hpp"

#include <cmath>
#include <cstddef>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Sorts spheres front to back, so that most of what is hidden is found to be so before it is
/// shaded; those outside of the picture, which may still throw shadows into it, come last.
class DrawOrder {
 public:
  /// @param aspect width of the picture over its height
  /// @return the items in order, valid until the next call
  const std::vector<SphereItem>& sort(const std::vector<SphereItem>& items, const View& view,
                                      Real aspect);
  std::size_t all() const { return ordered_.size(); }
  /// How many of them, the first ones, are in the picture.
  std::size_t visible() const { return visible_; }
  /// How near the nearest of these comes to the eye [m]; infinite where there is none.
  float nearest() const { return nearest_; }

 private:
  std::vector<SphereItem> ordered_;
  std::vector<float> distances_;
  std::vector<std::size_t> ends_;
  std::size_t visible_ = 0;
  float nearest_ = HUGE_VALF;
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
