/// Scene mass-ratio: heavy bodies on light ones.
#include "src/scenes/makers.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace scenes {

// Heavy bodies of 100 kg and 1000 kg alternate. Each stands on a box of 1 kg of the same width.
Scene make_mass_ratio(const Counts& counts) {
  constexpr Real kHalf = Real(0.5), kSpacing = 3;
  Scene scene;
  scene.name = "mass-ratio";
  const auto add_pair = [&](std::uint32_t i, Real z, bool is_sphere) {
    const Real x = static_cast<Real>(i) * kSpacing, mass = i % 2 == 0 ? 100 : 1000;
    const Vec3 above{x, 3 * kHalf, z};
    scene.bodies.push_back(box_at({x, kHalf, z}, {kHalf, kHalf, kHalf}, 1));
    scene.bodies.push_back(is_sphere ? sphere_at(above, kHalf, mass)
                                     : box_at(above, {kHalf, kHalf, kHalf}, mass));
  };
  for (std::uint32_t i = 0; i < counts.boxes; ++i) add_pair(i, 0, false);
  for (std::uint32_t i = 0; i < counts.spheres; ++i) add_pair(i, kSpacing, true);
  add_ground(scene);
  return scene;
}

}  // namespace scenes
}  // namespace JFPX_ABI
}  // namespace jfpx
