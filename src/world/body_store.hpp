/// Storage of a world's bodies: one array per quantity, indexed by BodyId::index.
#pragma once

#include <jfpx/scene.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// State that a step changes. Copied before each step, so that a failed step can be undone.
struct MotionArrays {
  std::vector<Vec3> position;  ///< [m]
  std::vector<Quat> orientation;
  std::vector<Vec3> velocity;           ///< [m/s]
  std::vector<Vec3> angular_velocity;   ///< [rad/s], world axes
  std::vector<Vec3> force;              ///< [N], for the next step
  std::vector<Vec3> torque;             ///< [N m], for the next step
  std::vector<Vec3> last_acceleration;  ///< [m/s^2], in the last step
  std::vector<Mat3> inverse_inertia;    ///< [1/(kg m^2)], world axes
  std::vector<Real> motion;             ///< [m^2/s^2], recency-weighted mean (thesis 4.4.2)
  std::vector<std::uint8_t> awake;      ///< 1 or 0; for mass 0: 1 for a moving kinematic body
};

/// Owns the bodies, their ids and their free motion. The slot of a removed body is reused with a
/// new generation. Loops visit ids(), in the order of indices.
class BodyStore {
 public:
  BodyStore(Real dt, const SleepSettings& sleep);

  /// @param def must have passed validation
  /// @throws std::bad_alloc without a change
  BodyId add(const BodyDef& def);
  /// @param id must be contained
  void remove(BodyId id) noexcept;
  bool contains(BodyId id) const noexcept;
  /// The index of a contained body. @throws InvalidArgument for any other
  std::uint32_t require(BodyId id) const;
  std::span<const BodyId> ids() const noexcept { return ids_; }
  /// The id of the body that currently has the index.
  BodyId id(std::uint32_t body) const { return {body, generation_[body]}; }
  /// Number of slots ever used; upper bound of all indices.
  std::size_t capacity() const noexcept { return generation_.size(); }
  std::uint32_t movable_count() const noexcept { return movable_count_; }

  BodyState state(std::uint32_t body) const;
  /// Replaces position, orientation and velocities, and wakes the body.
  void set_state(std::uint32_t body, const BodyState& state);

  /// Adds to the force and torque of the next step and wakes the body (erratum E29). Has no effect
  /// on an immovable body.
  void apply_force(std::uint32_t body, const Vec3& force);
  void apply_torque(std::uint32_t body, const Vec3& torque);
  /// Wakes the body with a motion of twice the sleep epsilon, so that a weak force has time to act.
  void wake(std::uint32_t body);
  /// Wakes the body with the motion of an awake body in contact with it.
  void wake_by_contact(std::uint32_t sleeper, std::uint32_t awake);
  /// Raises the motion of an awake body to at least twice the sleep epsilon.
  void keep_awake(std::uint32_t body);

  /// Moves a body without a change of velocity.
  void displace(std::uint32_t body, const Vec3& shift, const Vec3& rotation);

  /// Advances all awake bodies by one step of free motion, and puts bodies at rest to sleep.
  void integrate();

  bool movable(std::uint32_t body) const { return inverse_mass_[body] > 0; }
  bool kinematic(std::uint32_t body) const { return kinematic_[body] != 0; }
  /// Whether a kinematic body is in motion.
  bool has_moving_kinematic_body() const;
  const Shape& shape(std::uint32_t body) const { return shape_[body]; }
  Real mass(std::uint32_t body) const { return mass_[body]; }
  Real inverse_mass(std::uint32_t body) const { return inverse_mass_[body]; }
  Real friction(std::uint32_t body) const { return friction_[body]; }
  Real restitution(std::uint32_t body) const { return restitution_[body]; }
  /// [m]; 0 for a body that is not a sphere
  Real radius(std::uint32_t body) const { return radius_[body]; }
  Real dt() const { return dt_; }

  MotionArrays moving;

 private:
  void add_slot();
  void set_inertia(std::uint32_t body, const BodyDef& def);
  void integrate(std::uint32_t body);
  void move(std::uint32_t body);
  bool falls_asleep(std::uint32_t body);
  void refresh_inertia(std::uint32_t body);

  Real dt_;
  SleepSettings sleep_;
  Real motion_kept_;  ///< bias^dt

  std::vector<Shape> shape_;
  std::vector<Real> radius_, mass_, inverse_mass_, friction_, restitution_;
  std::vector<Mat3> body_inverse_inertia_;  ///< body axes
  std::vector<Mat3> tensor_;  ///< body axes, relative to the largest moment; 0 if isotropic
  std::vector<Vec3> acceleration_;
  std::vector<Real> velocity_kept_, angular_velocity_kept_;  ///< damping^dt
  std::vector<std::uint8_t> can_sleep_, kinematic_;
  std::vector<std::uint32_t> generation_;

  std::vector<BodyId> ids_;
  std::vector<std::uint32_t> free_;
  std::uint32_t movable_count_ = 0, kinematic_count_ = 0;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
