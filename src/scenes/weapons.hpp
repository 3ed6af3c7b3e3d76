/// The weapons of the ballistic demos and their rigid rounds.
#pragma once

#include <jfpx/body.hpp>

#include <array>
#include <cstdint>
#include <string_view>

namespace jfpx {
inline namespace JFPX_ABI {
namespace scenes {

enum class Weapon : std::uint8_t { pistol, artillery, fireball, laser };
inline constexpr std::array<std::string_view, 4> kWeaponNames{"pistol", "artillery", "fireball",
                                                              "laser"};

/// [m], start position of the rounds of big-ballistic.
inline constexpr Vec3 kBigGun{0, 3, 0};

/// The initial state of a round of big-ballistic, with the numbers of the original.
BodyDef big_round(Weapon weapon);

}  // namespace scenes
}  // namespace JFPX_ABI
}  // namespace jfpx
