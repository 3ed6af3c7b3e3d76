/// What the two ballistic demos share: weapons, controls, and how long rounds live.
#pragma once

#include "src/demos/makers.hpp"
#include "src/scenes/weapons.hpp"

#include <array>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace demos {

using scenes::Weapon;

/// Controls of both demos. The weapons have the numbers of Weapon.
enum GunControl : std::size_t { kFire = 4, kResetGun = 5 };
inline constexpr std::array<Control, 6> kGunControls{{{"pistol", "choose the pistol", "1"},
                                                      {"artillery", "choose the artillery", "2"},
                                                      {"fireball", "choose the fireball", "3"},
                                                      {"laser", "choose the laser", "4"},
                                                      {"fire", "fire one round", "mouse"},
                                                      {"reset", "start again", "r"}}};

inline constexpr std::size_t kMaxRounds = 160;  ///< in flight; beyond, nothing is fired
inline constexpr Real kLongestShot = 200;       ///< [m], along z
inline constexpr double kOldestRound = 5;       ///< [s]; the original's never ended (E44, E45)

/// Who has flown far, long, or into the ground is taken away.
inline bool spent(const Vec3& position, double age) {
  return position.y < 0 || position.z > kLongestShot || age > kOldestRound;
}

/// A demo with a gun: which weapon is chosen, and when it fires.
class GunDemo : public Demo {
 protected:
  GunDemo() : Demo(kGunControls) {}
  /// "laser, 3 of 160 rounds in flight"
  std::string gun_text() const;

 private:
  void act(std::size_t control) final;
  virtual std::size_t rounds() const = 0;  ///< in flight
  virtual void fire(Weapon weapon) = 0;
  virtual void restart() = 0;

  Weapon weapon_ = Weapon::laser;
};

/// The gun's place, its shadow, and lines across the range.
void draw_range(View* view, const Vec3& gun);

}  // namespace demos
}  // namespace JFPX_ABI
}  // namespace jfpx
