/// Rigid bodies: what a scene says about one, and what a world knows about one.
#pragma once

#include <jfpx/shape.hpp>

#include <cstdint>
#include <optional>
#include <span>

namespace jfpx {
inline namespace JFPX_ABI {

/// Names a body of one World for the body's whole life. The id of a removed body never comes back.
/// In another World it names whatever body has the same place there, or none.
struct BodyId {
  std::uint32_t index = 0xffffffffu;
  std::uint32_t generation = 0;
  friend bool operator==(const BodyId&, const BodyId&) = default;
};

/// One rigid body as a scene describes it. SI units.
struct BodyDef {
  Shape shape = Sphere{};
  Real mass = 1;  ///< [kg], >= 0; 0 means immovable
  /// Only with mass 0, and not of half-spaces and planes: moves with its velocities, which nothing
  /// changes but World::set_state(). Pushes others and is never pushed, however heavy they are.
  bool kinematic = false;
  /// [kg m^2], about the centre of mass, in body axes; that of the solid shape if absent.
  /// Symmetric, positive definite, no principal moment larger than the sum of the others. Mass 0
  /// has none.
  std::optional<Mat3> inertia;
  Vec3 position;  ///< [m], centre of mass
  Quat orientation;
  Vec3 velocity;          ///< [m/s]; a body that is immovable and not kinematic stays at rest
  Vec3 angular_velocity;  ///< [rad/s], world frame; likewise
  /// [m/s^2], constant: gravity, unless set. Ignored by an immovable body.
  Vec3 acceleration{0, Real(-9.81), 0};
  Real linear_damping = 1;    ///< [-], share of velocity kept per second, in (0, 1]
  Real angular_damping = 1;   ///< [-], likewise for angular velocity
  Real friction = Real(0.5);  ///< [-], >= 0; combined as Scene::materials says
  Real restitution = 0;       ///< [-], in [0, 1]; likewise
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

/// Places and directions in the axes of the body and of the world (thesis 4.4.2). A body's own
/// origin is its centre of mass.
JFPX_HD constexpr Transform pose(const BodyState& body) {
  return make_transform(body.orientation, body.position);
}
JFPX_HD constexpr Vec3 to_world_point(const BodyState& body, const Vec3& local) {
  return transform_point(pose(body), local);
}
JFPX_HD constexpr Vec3 to_local_point(const BodyState& body, const Vec3& world) {
  return inverse_transform_point(pose(body), world);
}
JFPX_HD constexpr Vec3 to_world_direction(const BodyState& body, const Vec3& local) {
  return transform_direction(pose(body), local);
}
JFPX_HD constexpr Vec3 to_local_direction(const BodyState& body, const Vec3& world) {
  return inverse_transform_direction(pose(body), world);
}
/// Velocity of the material point of the body that is at `point` in the world [m/s].
JFPX_HD constexpr Vec3 velocity_at(const BodyState& body, const Vec3& point) {
  return body.velocity + cross(body.angular_velocity, point - body.position);
}

/// Hash over the bits of all states, in order: equal hashes mean the same world to the last bit.
/// (-0 and 0 differ.) Float and double worlds have different hashes.
JFPX_API std::uint64_t state_hash(std::span<const BodyState> states) noexcept;

}  // namespace JFPX_ABI
}  // namespace jfpx
