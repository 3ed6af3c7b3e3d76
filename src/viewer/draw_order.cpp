/// Sorting of spheres by distance for drawing.
#include "src/viewer/draw_order.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

constexpr std::uint32_t kShells = 2048;  // bins of distance; one more for invisible items
constexpr float kInvisible = -1;         // in place of the distance of an invisible item

/// Side planes of the view frustum, in coordinates of the camera.
class Frustum {
 public:
  Frustum(const View& view, Real aspect)
      : axes_{view.right, view.up, view.forward},
        slopes_{std::tan(view.fov_y / 2) * aspect, std::tan(view.fov_y / 2)} {
    // Anti-aliasing smooths edges over a pixel, so the frustum is widened by more than a pixel.
    for (Real& slope : slopes_) slope += Real(0.01);
    for (std::size_t i = 0; i < 2; ++i) lengths_[i] = std::sqrt(1 + slopes_[i] * slopes_[i]);
  }

  bool meets(const Vec3& centre, Real radius) const {
    const Real ahead = dot(centre, axes_[2]);
    if (ahead < -radius) return false;
    for (std::size_t i = 0; i < 2; ++i) {
      const Real aside = std::fabs(dot(centre, axes_[i]));
      if (aside - ahead * slopes_[i] > radius * lengths_[i]) return false;
    }
    return true;
  }

 private:
  std::array<Vec3, 3> axes_;
  std::array<Real, 2> slopes_;
  std::array<Real, 2> lengths_{};
};

}  // namespace

const std::vector<SphereItem>& DrawOrder::sort(const std::vector<SphereItem>& items,
                                               const View& view, Real aspect) {
  const Frustum frustum(view, aspect);
  distances_.resize(items.size());
  float farthest = 0;
  nearest_ = HUGE_VALF;
  for (std::size_t i = 0; i < items.size(); ++i) {
    const float(&c)[3] = items[i].centre;
    distances_[i] = kInvisible;
    if (!frustum.meets({Real(c[0]), Real(c[1]), Real(c[2])}, Real(items[i].radius))) continue;
    const float front = std::sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]) - items[i].radius;
    if (!std::isfinite(front)) continue;
    distances_[i] = std::max(front, 0.0f);
    nearest_ = std::min(nearest_, distances_[i]);
    farthest = std::max(farthest, distances_[i]);
  }
  const float scale = farthest > nearest_ ? (kShells - 1) / (farthest - nearest_) : 0;
  const auto shell_of = [&](float distance) {
    return distance < 0 ? kShells : static_cast<std::uint32_t>((distance - nearest_) * scale);
  };
  // Counting sort: each offset is the end of the previous shell and advances with each item.
  ends_.assign(kShells + 2, 0);
  for (const float distance : distances_) ++ends_[shell_of(distance) + 1];
  for (std::uint32_t s = 1; s < ends_.size(); ++s) ends_[s] += ends_[s - 1];
  visible_ = ends_[kShells];
  ordered_.resize(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) {
    ordered_[ends_[shell_of(distances_[i])]++] = items[i];
  }
  return ordered_;
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
