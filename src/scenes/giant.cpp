/// Scene giant: one large sphere on a bed of small ones.
#include "src/scenes/makers.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace scenes {

// The bed is a lattice in a box, four times as wide as high. The giant has a thousandth of the
// density of the grains and starts on top. It counts as one of the spheres.
Scene make_giant(const Counts& counts) {
  constexpr Real kGrain = Real(0.1), kGiant = 20, kSpacing = Real(2.05) * kGrain;
  Scene scene;
  scene.name = "giant";
  Random random(counts.seed);
  const std::uint32_t grains = counts.spheres > 0 ? counts.spheres - 1 : 0;
  std::uint32_t side = 1;
  while (std::uint64_t{side} * side * side < std::uint64_t{8} * grains) ++side;
  for (std::uint32_t i = 0; i < grains; ++i) {
    constexpr Real kJitter = Real(0.02) * kGrain;
    const Vec3 jitter =
        random.uniform_in_box({-kJitter, -kJitter, -kJitter}, {kJitter, kJitter, kJitter});
    const Vec3 site = lattice_site(i, side) * kSpacing;
    scene.bodies.push_back(sphere_at(site + jitter + Vec3{0, kGrain, 0}, kGrain, 1));
  }
  const Real width = static_cast<Real>(side - 1) * kSpacing;
  const std::uint32_t layers = (grains + side * side - 1) / (side * side);
  const Real top = static_cast<Real>(layers) * kSpacing + kGrain;
  // The giant is wider than the box, so it does not collide with the walls.
  BodyDef walls;
  walls.filter.category = 2;
  if (counts.spheres > 0) {
    BodyDef giant = sphere_at({width * Real(0.5), top + kGiant, width * Real(0.5)}, kGiant, 8000);
    giant.filter.mask = ~walls.filter.category;
    scene.bodies.push_back(giant);
  }
  const Real gap = Real(1.1) * kGrain;
  add_container(scene, {-gap, 0, -gap}, {width + gap, top, width + gap}, false, walls);
  return scene;
}

}  // namespace scenes
}  // namespace JFPX_ABI
}  // namespace jfpx
