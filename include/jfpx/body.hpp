/// Rigid bodies: what a scene says about one, and what a world knows about one.
#pragma once

#include <jfpx/shape.hpp>

#include <cstdint>
#include <span>

namespace jfpx::inline JFPX_ABI {

/// Names a body of one World for the body's whole life. The id of a removed body never comes back.
struct BodyId {
  std::uint32_t index = 0xffffffffu;
  std::uint32_t generation = 0;
  friend bool operator==(const BodyId&, const BodyId&) = default;
};

/// One rigid body as a scene describes it. SI units.
struct BodyDef {
  Shape shape = Sphere{};
  Real mass = 1;  ///< [kg], >= 0; 0 means immovable
  Vec3 position;  ///< [m], centre of mass
  Quat orientation;
  Vec3 velocity;                         ///< [m/s]; an immovable body stays at rest
  Vec3 angular_velocity;                 ///< [rad/s], world frame; likewise
  Vec3 acceleration{0, Real(-9.81), 0};  ///< [m/s^2], constant; ignored by an immovable body
  Real linear_damping = 1;               ///< [-], share of velocity kept per second, in (0, 1]
  Real angular_damping = 1;              ///< [-], likewise for angular velocity
  Real friction = Real(0.5);             ///< [-], >= 0; combined as Scene::materials says
  Real restitution = 0;                  ///< [-], in [0, 1]; likewise
  bool can_sleep = true;
  friend bool operator==(const BodyDef&, const BodyDef&) = default;
};

/// The moving part of a body's state.
struct BodyState {
  Vec3 position;  ///< [m]
  Quat orientation;
  Vec3 velocity;          ///< [m/s]
  Vec3 angular_velocity;  ///< [rad/s], world frame
  friend bool operator==(const BodyState&, const BodyState&) = default;
};

/// Hash over the bits of all states, in order: equal hashes mean the same world to the last bit.
/// (-0 and 0 differ.) Float and double worlds have different hashes.
JFPX_API std::uint64_t state_hash(std::span<const BodyState> states) noexcept;

}  // namespace jfpx::inline JFPX_ABI
