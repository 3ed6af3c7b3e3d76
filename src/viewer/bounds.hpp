/// Where the bodies of a scene are: a ball around nearly all that moves.
#pragma once

#include <jfpx/scene.hpp>

#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// A ball that holds what is worth seeing.
struct Bounds {
  Vec3 centre;
  Real radius = 1;
  Vec3 half_extents{};  ///< of the upright box around it
};

/// The bodies that tell where a scene's crowd is: a few thousand of those that move or, in a scene
/// where nothing does, of the rest.
class Survey {
 public:
  explicit Survey(const Scene& scene);

  /// The ball around them, leaving out the one in fifty that went astray on each side.
  Bounds bounds(const std::vector<BodyState>& states) const;

 private:
  std::vector<std::uint32_t> bodies_;
  Real largest_ = 0;  ///< radius of the largest body [m]
};

/// The bounds of a scene that is asked about once.
inline Bounds bounds_of(const Scene& scene, const std::vector<BodyState>& states) {
  return Survey(scene).bounds(states);
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
