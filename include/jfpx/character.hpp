/// Motion of a character that is controlled by a game, by queries of a World: a capsule that slides
/// along walls, climbs steps and stays on the ground.
#pragma once

#include <jfpx/world.hpp>

#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Shape and abilities of a character. The capsule is upright: its axis has the direction `up`.
struct CharacterSettings {
  Real radius = Real(0.3);       ///< [m], > 0, of the capsule
  Real half_height = Real(0.6);  ///< [m], > 0, half the length of the segment of the capsule
  Vec3 up{0, 1, 0};              ///< [-], finite and longer than kEpsilon, of any length
  /// [rad], from 0 to 1.5: the steepest ground on which the character stands and walks
  Real max_slope = Real(0.8);
  Real step_height = Real(0.4);  ///< [m], >= 0: the highest step that it climbs or descends
  /// [m], > 0 and less than the radius: the distance that is kept from all surfaces
  Real skin = Real(0.02);
  /// Bodies that are obstacles; empty: all. Sensors never are. A body that represents the character
  /// for other bodies must be excluded.
  BodyFilter filter = {};
};

enum class GroundState : std::uint8_t {
  air,     ///< the character touches no ground
  ground,  ///< it stands or walks on ground that is not too steep, or is held by steep surfaces
  steep    ///< it slides down ground that is steeper than CharacterSettings::max_slope
};

/// State of a character: a plain value, so that games can store, restore and repeat it.
struct CharacterState {
  Vec3 position;  ///< [m], of the middle of the capsule, within kMaxCoordinate
  /// [m/s]. On the ground: relative to the ground, and the result of a move is horizontal. In the
  /// air: in the world.
  Vec3 velocity;
  GroundState ground_state = GroundState::air;
  BodyId ground_body = {};        ///< the body below; invalid in the air
  Vec3 ground_normal = {};        ///< [-], unit, of the surface below; zero in the air
  Vec3 ground_velocity = {};      ///< [m/s], of the body below at the feet; zero in the air
  std::uint32_t ground_part = 0;  ///< of the body below, as in RayHit; 0 in the air
  friend bool operator==(const CharacterState&, const CharacterState&) = default;
};

/// A body that blocked a move.
struct CharacterHit {
  BodyId body;
  Vec3 point;               ///< [m], world, of the surface of the body
  Vec3 normal;              ///< [-], unit, from the body to the character
  Real approach_speed = 0;  ///< [m/s], >= 0, of character and body along the normal, before the hit
  std::uint32_t part = 0;   ///< of the body, as in RayHit
  friend bool operator==(const CharacterHit&, const CharacterHit&) = default;
};

/// Result of move_character().
struct CharacterMove {
  CharacterState state;
  std::vector<CharacterHit> hits;  ///< in the order of the move, one for each body: the fastest
};

/// Moves a character by `dt` with the velocity of its state, to which the game has added gravity,
/// the wanted direction and jumps. Call it once after each World::step(), with the dt of the world.
///   - The character first moves with the body on which it stands, and leaves bodies that have
///     moved into it, by at most its radius.
///   - On the ground, it walks along the surface with the horizontal part of the velocity, climbs
///     steps, follows descending ground and steps, and slides along walls. A downward velocity has
///     no effect.
///   - With an upward velocity of at least a millimetre per second, it leaves the ground.
///   - In the air, and on steep ground, it slides along all surfaces, and does not rise along steep
///     ones.
/// The velocity of the result is without the components that surfaces stopped. When the character
/// leaves a moving body, it keeps the velocity of the body. Equal arguments and equal worlds give
/// equal bits. The world is not changed: a game can push World::apply_impulse_at_point() on hits.
/// @param dt [s], > 0
/// @throws InvalidArgument for a field that is out of its range, or a move that ends outside
///   kMaxCoordinate; std::bad_alloc
JFPX_API CharacterMove move_character(const World& world, const CharacterSettings& settings,
                                      const CharacterState& state, Real dt);

}  // namespace JFPX_ABI
}  // namespace jfpx
