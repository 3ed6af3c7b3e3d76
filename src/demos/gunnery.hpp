/// Base of the two ballistic demos: weapons, controls, and the lifetime of rounds.
#pragma once

#include "src/demos/makers.hpp"
#include "src/scenes/weapons.hpp"

#include <array>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace demos {

using scenes::Weapon;

/// Indices of the controls of both demos. Controls 0 to 3 are the values of Weapon.
enum GunControl : std::size_t { kFire = 4, kResetGun = 5 };
inline constexpr std::array<Control, 6> kGunControls{{{"pistol", "choose the pistol", "1"},
                                                      {"artillery", "choose the artillery", "2"},
                                                      {"fireball", "choose the fireball", "3"},
                                                      {"laser", "choose the laser", "4"},
                                                      {"fire", "fire one round", "mouse"},
                                                      {"reset", "restart", "r"}}};

inline constexpr std::size_t kMaxRounds = 160;  ///< in flight; at this number, "fire" has no effect
inline constexpr Real kMaxRange = 200;          ///< [m], along z
inline constexpr double kMaxAge = 5;            ///< [s]; unlimited in the original (E44, E45)

/// True if a round must be removed: it is below the ground, out of range or too old.
inline bool spent(const Vec3& position, double age) {
  return position.y < 0 || position.z > kMaxRange || age > kMaxAge;
}

/// Demo with a gun: selection of the weapon, and firing.
class GunDemo : public Demo {
 protected:
  GunDemo() : Demo(kGunControls) {}
  /// A line of text, for example "laser, 3 of 160 rounds in flight".
  std::string gun_text() const;

 private:
  void act(std::size_t control) final;
  virtual std::size_t rounds() const = 0;  ///< number of rounds in flight
  virtual void fire(Weapon weapon) = 0;
  virtual void restart() = 0;

  Weapon weapon_ = Weapon::laser;
};

/// Draws a marker at the gun, its shadow, and lines across the range.
void draw_range(View* view, const Vec3& gun);

}  // namespace demos
}  // namespace JFPX_ABI
}  // namespace jfpx
