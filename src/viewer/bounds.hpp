/// Bounding sphere of the bodies of a scene, without outliers.
#pragma once

#include <jfpx/scene.hpp>

#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Bounding sphere, and the axis-aligned box inside it.
struct Bounds {
  Vec3 centre;
  Real radius = 1;
  Vec3 half_extents{};  ///< of the axis-aligned box
};

/// Estimates the bounds of a scene from a sample of a few thousand movable bodies, or of immovable
/// bodies in a scene without movable ones.
class BoundsEstimator {
 public:
  explicit BoundsEstimator(const Scene& scene);

  /// The bounds, excluding the outermost 2 % of the sample at each end of each axis.
  Bounds bounds(const std::vector<BodyState>& states) const;

 private:
  struct Sample {
    std::uint32_t body;
    Vec3 middle;  ///< of its shape, in body axes
  };
  std::vector<Sample> samples_;
  Real largest_ = 0;  ///< radius of the largest body [m]
};

/// The bounds of a scene, for a single use.
inline Bounds bounds_of(const Scene& scene, const std::vector<BodyState>& states) {
  return BoundsEstimator(scene).bounds(states);
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
