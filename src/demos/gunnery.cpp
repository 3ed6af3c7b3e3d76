/// Controls and drawing of both ballistic demos.
#include "src/demos/gunnery.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace demos {

void draw_range(View* view, const Vec3& gun) {
  add_ground_lines(view, 5, 10, 20);
  const Item marker{.shape = Sphere{Real(0.1)}, .position = gun, .colour = kBlack};
  view->items.push_back(shadow_of(marker, Real(0.1)));
  view->items.push_back(marker);
}

void GunDemo::act(std::size_t control) {
  if (control == kFire) {
    if (rounds() < kMaxRounds) fire(weapon_);
  } else if (control == kResetGun) {
    weapon_ = Weapon::laser;
    restart();
  } else {
    weapon_ = static_cast<Weapon>(control);
  }
}

std::string GunDemo::gun_text() const {
  return std::string(scenes::kWeaponNames[static_cast<std::size_t>(weapon_)]) + ", " +
         std::to_string(rounds()) + " of " + std::to_string(kMaxRounds) + " rounds in flight";
}

}  // namespace demos
}  // namespace JFPX_ABI
}  // namespace jfpx
