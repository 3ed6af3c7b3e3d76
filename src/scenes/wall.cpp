/// Scene wall: bricks in running bond, and balls that hit the middle of the wall.
#include "src/scenes/makers.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace scenes {

// Rows of ten bricks. Every second row is shifted by a quarter of a brick.
Scene make_wall(const Counts& counts) {
  constexpr std::uint32_t kBricksPerRow = 10;
  const Vec3 half{Real(0.5), Real(0.25), Real(0.25)};
  Scene scene;
  scene.name = "wall";
  for (std::uint32_t i = 0; i < counts.boxes; ++i) {
    const std::uint32_t row = i / kBricksPerRow;
    const Real shift = row % 2 == 0 ? Real(0.125) : Real(-0.125);
    const Real x = static_cast<Real>(i % kBricksPerRow) - Real(4.5) + shift;
    const Real y = (static_cast<Real>(row) + Real(0.5)) * 2 * half.y;
    scene.bodies.push_back(box_at({x, y, 0}, half, 5));
  }
  add_ground(scene);
  const std::uint32_t rows = (counts.boxes + kBricksPerRow - 1) / kBricksPerRow;
  add_balls(scene, counts.spheres, {0, static_cast<Real>(rows) * half.y, -half.z});
  return scene;
}

}  // namespace scenes
}  // namespace JFPX_ABI
}  // namespace jfpx
