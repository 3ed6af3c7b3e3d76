/// Sorting of spheres by distance for drawing.
#pragma once

#include "src/viewer/camera.hpp"
#include "src/viewer/drawing.hpp"

#include <cmath>
#include <cstddef>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Sorts spheres front to back, so that the depth test rejects most hidden spheres before shading.
/// Spheres outside the view frustum, which may still cast shadows into it, come last.
class DrawOrder {
 public:
  /// @param aspect ratio of the width of the picture to its height
  /// @return the sorted items, valid until the next call
  const std::vector<SphereItem>& sort(const std::vector<SphereItem>& items, const View& view,
                                      Real aspect);
  std::size_t all() const { return ordered_.size(); }
  /// Number of items in the view frustum; they come first.
  std::size_t visible() const { return visible_; }
  /// Distance of the nearest visible surface from the eye [m]; infinite if nothing is visible.
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
