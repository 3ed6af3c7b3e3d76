/// Rigid bodies: definition, id and state of motion.
#pragma once

#include <jfpx/shape.hpp>

#include <cstdint>
#include <optional>
#include <span>

namespace jfpx {
inline namespace JFPX_ABI {

/// Identifies a body of one World for the lifetime of the body. The id of a removed body is not
/// reused, unless World::restore() goes back to a time before the body was added. In another World,
/// the id refers to the body with the same index and generation, if any.
struct BodyId {
  std::uint32_t index = 0xffffffffu;
  std::uint32_t generation = 0;
  friend bool operator==(const BodyId&, const BodyId&) = default;
};

/// Selects the bodies with which a body collides, as in Box2D and Bullet: see may_collide().
struct CollisionFilter {
  std::uint32_t category = 1;        ///< bits of the categories to which the body belongs
  std::uint32_t mask = 0xffffffffu;  ///< bits of the categories with which it collides
  friend bool operator==(const CollisionFilter&, const CollisionFilter&) = default;
};

/// Whether the filters let two bodies collide: each body has a category that is in the mask of the
/// other.
JFPX_HD constexpr bool may_collide(const CollisionFilter& a, const CollisionFilter& b) {
  return (a.category & b.mask) != 0 && (b.category & a.mask) != 0;
}

/// Axes of the world along which (linear) or about which (angular) a body does not move, as in
/// Box2D. A movable body keeps its coordinates along locked axes, and its velocities along and
/// about them are 0. A kinematic body keeps its velocities, which act on the bodies in contact: it
/// is a conveyor. See docs/world.md for how contacts and joints act on these bodies.
struct MotionLocks {
  bool linear_x = false, linear_y = false, linear_z = false;
  bool angular_x = false, angular_y = false, angular_z = false;
  friend bool operator==(const MotionLocks&, const MotionLocks&) = default;
};

/// The body does not rotate, as the character of a game: the three angular axes are locked.
inline constexpr MotionLocks kFixedRotation{false, false, false, true, true, true};
/// The body moves in a plane of constant z, as the bodies of a game in two dimensions: linear_z,
/// angular_x and angular_y are locked.
inline constexpr MotionLocks kPlanarMotion{false, false, true, true, true, false};
/// The body keeps its pose, as a conveyor belt or a turntable: all axes are locked.
inline constexpr MotionLocks kFixedPose{true, true, true, true, true, true};

/// Definition of a rigid body in a scene. SI units.
struct BodyDef {
  Shape shape = Sphere{};
  Real mass = 1;  ///< [kg], >= 0; 0 means immovable
  /// A body that moves with constant velocities, which only World::set_state() changes. It pushes
  /// other bodies and is never pushed, whatever their mass. Requires mass 0; not allowed for
  /// half-spaces and planes.
  bool kinematic = false;
  /// [kg m^2], about the centre of mass, in body axes. If absent, the inertia of the solid shape.
  /// Symmetric and positive definite, with no principal moment larger than the sum of the others.
  /// Must be absent for mass 0.
  std::optional<Mat3> inertia;
  Vec3 position;          ///< [m], centre of mass
  Quat orientation;       ///< [-], unit, from body to world axes
  Vec3 velocity;          ///< [m/s]; ignored if the body is immovable and not kinematic
  Vec3 angular_velocity;  ///< [rad/s], world frame; ignored like `velocity`
  /// [m/s^2], constant; gravity by default. Ignored for an immovable body.
  Vec3 acceleration{0, Real(-9.81), 0};
  Real linear_damping = 1;    ///< [-], fraction of velocity kept per second, in (0, 1]
  Real angular_damping = 1;   ///< [-], fraction of angular velocity kept per second, in (0, 1]
  Real friction = Real(0.5);  ///< [-], >= 0; combined by the rule of Scene::materials
  Real restitution = 0;       ///< [-], in [0, 1]; combined by the rule of Scene::materials
  /// [m], >= 0. The torques that oppose rolling and spinning are limited to this length times the
  /// normal force. The larger value of the two bodies applies. Solver::soft_step only.
  Real rolling_friction = 0, spinning_friction = 0;
  bool can_sleep = true;   ///< the body may fall asleep; see SleepSettings
  CollisionFilter filter;  ///< bodies with which it collides
  /// A sensor has contacts and contact events, but the contacts are not resolved and wake no body.
  /// Contacts of contact generators are resolved.
  bool sensor = false;
  /// Axes along or about which the body does not move; velocities of a movable body along or about
  /// them become 0. Ignored for an immovable body. Solver::soft_step only.
  MotionLocks motion_locks;
  std::uint64_t user_data = 0;  ///< application data without effect
  friend bool operator==(const BodyDef&, const BodyDef&) = default;
};

/// State of motion of a body.
struct BodyState {
  Vec3 position;          ///< [m], centre of mass
  Quat orientation;       ///< [-], unit, from body to world axes
  Vec3 velocity;          ///< [m/s]
  Vec3 angular_velocity;  ///< [rad/s], world frame
  friend bool operator==(const BodyState&, const BodyState&) = default;
};

/// State between two steps, for drawing: linear interpolation, of orientations normalized and along
/// the shorter arc. If set_state() has moved the body in between, draw `after`.
/// @param t [-], 0: `before`, 1: `after`
JFPX_HD inline BodyState interpolate(const BodyState& before, const BodyState& after, Real t) {
  const auto mix = [t](const Vec3& a, const Vec3& b) { return a * (1 - t) + b * t; };
  return {
      mix(before.position, after.position), interpolate(before.orientation, after.orientation, t),
      mix(before.velocity, after.velocity), mix(before.angular_velocity, after.angular_velocity)};
}

/// The state with the velocities that take a kinematic body to a pose in one step, along the
/// shorter arc: to be passed to World::set_state() before each step of a path. Velocities remain
/// until they are changed, so set them to 0 at the end. The rotation is exact for 4 substeps. Its
/// error for other numbers grows with the third power of the angle: less than a degree at 45
/// degrees. The steps of a path do not drift, because each starts at the pose that was reached.
/// @param orientation [-], unit
/// @param dt [s], > 0, of the world
JFPX_HD inline BodyState moving_to(BodyState state, const Vec3& position, const Quat& orientation,
                                   Real dt) {
  const Quat turn = orientation * conjugate(state.orientation);
  const Real sign = turn.w < 0 ? Real(-1) : Real(1);
  const Vec3 axis{turn.x * sign, turn.y * sign, turn.z * sign};  // times sin(angle / 2)
  const Real w = turn.w * sign;
  // Substeps rotate by 2 atan(h omega / 2) (integrate.hpp), so omega is 8 tan(angle / 8) / dt.
  const Real quarter = square_root((1 + w) * Real(0.5));  // cos(angle / 4)
  constexpr Real kRounding = 4 * kEpsilon;
  const bool is_there = length_squared(axis) < kRounding * kRounding;
  state.velocity = (position - state.position) * (1 / dt);
  state.angular_velocity = is_there ? Vec3{} : axis * (4 / (quarter * (1 + quarter) * dt));
  return state;
}

/// Transforms of points and directions between body and world axes (thesis 4.4.2). The origin of
/// the body axes is the centre of mass.
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
/// Velocity of the body's material point at `point` in the world [m/s].
JFPX_HD constexpr Vec3 velocity_at(const BodyState& body, const Vec3& point) {
  return body.velocity + cross(body.angular_velocity, point - body.position);
}

/// Hash over the bits of all states, in order: equal hashes mean equal states to the last bit,
/// where -0 differs from 0. Float and double worlds have different hashes.
JFPX_API std::uint64_t state_hash(std::span<const BodyState> states) noexcept;

}  // namespace JFPX_ABI
}  // namespace jfpx
