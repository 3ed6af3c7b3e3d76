/// The drawing that the two ballistic demos share.
#include "examples/demos/gunnery.hpp"

namespace jfpx::inline JFPX_ABI::demos {

void draw_range(View* view, const Vec3& gun) {
  add_ground_lines(view, 5, 10, 20);
  const Item marker{.shape = Sphere{Real(0.1)}, .position = gun, .colour = kBlack};
  view->items.push_back(shadow_of(marker, Real(0.1)));
  view->items.push_back(marker);
}

std::string gun_text(Weapon weapon, std::size_t rounds) {
  return std::string(scenes::kWeaponNames[static_cast<std::size_t>(weapon)]) + ", " +
         std::to_string(rounds) + " of " + std::to_string(kMostRounds) + " rounds in flight";
}

}  // namespace jfpx::inline JFPX_ABI::demos
