/// Scene tower: crates on top of each other.
#include "src/scenes/makers.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace scenes {

Scene make_tower(const Counts& counts) {
  Scene scene;
  scene.name = "tower";
  for (std::uint32_t i = 0; i < counts.boxes; ++i) {
    const Real y = static_cast<Real>(i) + Real(0.5);
    scene.bodies.push_back(box_at({0, y, 0}, {Real(0.5), Real(0.5), Real(0.5)}, 1));
  }
  add_ground(scene);
  add_balls(scene, counts.spheres, {0, static_cast<Real>(counts.boxes) * Real(0.75), Real(-0.5)});
  return scene;
}

}  // namespace scenes
}  // namespace JFPX_ABI
}  // namespace jfpx
