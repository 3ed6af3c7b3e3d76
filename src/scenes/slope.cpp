/// Scene slope: boxes on two slopes, one that holds them and one that does not.
#include "src/scenes/makers.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace scenes {

// The angle of friction for 0.5 is 26.565 degrees. The first slope has 25.565 degrees, the second
// 27.565. Both descend along z. Boxes stand on both alternately; spheres roll.
Scene make_slope(const Counts& counts) {
  struct Slope {
    Real sine, cosine, half_sine, half_cosine;  // of the angle and of its half
  };
  static constexpr Slope kSlopes[] = {{Real(0.4315355758373472), Real(0.90209591883941542),
                                       Real(0.22125108040480232), Real(0.97521687814542446)},
                                      {Real(0.46275538956912393), Real(0.88648601197352705),
                                       Real(0.23823726411549576), Real(0.97120698411140116)}};
  constexpr Real kHalf = Real(0.5), kLength = 40, kThickness = 1, kSpacing = Real(1.5);
  Scene scene;
  scene.name = "slope";
  const std::uint32_t columns = (counts.boxes + counts.spheres + 1) / 2;
  const Real half_width = static_cast<Real>(columns) * kSpacing * Real(0.5) + 1;
  for (int s = 0; s < 2; ++s) {
    const Slope& slope = kSlopes[s];
    const Vec3 normal{0, slope.cosine, slope.sine};
    // A point of the surface near the upper edge of the slope.
    const Vec3 start{static_cast<Real>(s) * (2 * half_width + 2), 20, 0};
    const Vec3 down{0, -slope.sine, slope.cosine};
    const Quat orientation{slope.half_cosine, slope.half_sine, 0, 0};
    BodyDef ramp = box_at(start + down * (kLength - 1) - normal * kThickness,
                          {half_width, kThickness, kLength}, 0);
    ramp.orientation = orientation;
    scene.bodies.push_back(ramp);
    for (auto i = static_cast<std::uint32_t>(s); i < counts.boxes + counts.spheres; i += 2) {
      const std::uint32_t place = i / 2;
      const Real column = static_cast<Real>(place) - static_cast<Real>(columns - 1) * Real(0.5);
      const Vec3 position = start + Vec3{column * kSpacing, 0, 0} + normal * kHalf;
      BodyDef body = i < counts.boxes ? box_at(position, {kHalf, kHalf, kHalf}, 1)
                                      : sphere_at(position, kHalf, 1);
      body.orientation = orientation;
      scene.bodies.push_back(body);
    }
  }
  add_ground(scene);
  return scene;
}

}  // namespace scenes
}  // namespace JFPX_ABI
}  // namespace jfpx
