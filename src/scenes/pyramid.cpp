/// Scene pyramid: rows of crates, each one shorter than the row below.
#include "src/scenes/makers.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace scenes {

// The lowest row is long enough for all boxes; the highest rows may be incomplete.
Scene make_pyramid(const Counts& counts) {
  constexpr Real kGap = Real(0.05);  // between the crates of a row
  Scene scene;
  scene.name = "pyramid";
  std::uint32_t rows = 0;
  while (std::uint64_t{rows} * (rows + 1) / 2 < counts.boxes) ++rows;
  std::uint32_t left = counts.boxes;
  for (std::uint32_t row = 0; row < rows; ++row) {
    const std::uint32_t length = rows - row;
    for (std::uint32_t i = 0; i < length && left > 0; ++i, --left) {
      const Real x =
          (static_cast<Real>(i) - static_cast<Real>(length - 1) * Real(0.5)) * (1 + kGap);
      const Real y = static_cast<Real>(row) + Real(0.5);
      scene.bodies.push_back(box_at({x, y, 0}, {Real(0.5), Real(0.5), Real(0.5)}, 1));
    }
  }
  add_ground(scene);
  add_balls(scene, counts.spheres, {0, static_cast<Real>(rows) * Real(0.5), Real(-0.5)});
  return scene;
}

}  // namespace scenes
}  // namespace JFPX_ABI
}  // namespace jfpx
