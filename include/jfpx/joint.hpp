/// Joints: constraints of two bodies that act in every step until they are removed.
#pragma once

#include <jfpx/body.hpp>

#include <cstdint>
#include <optional>
#include <variant>

namespace jfpx {
inline namespace JFPX_ABI {

/// Identifies a joint of one World for the lifetime of the joint. The id of a removed joint is not
/// reused, unless World::restore() goes back to a time before the joint was added.
struct JointId {
  std::uint32_t index = 0xffffffffu;
  std::uint32_t generation = 0;
  friend bool operator==(const JointId&, const JointId&) = default;
};

/// Keeps the distance of two points of two bodies in a range: a rod if both lengths are equal, a
/// rope if min_length is 0. A spring may act between the limits. The limits are soft like contacts:
/// they yield slightly under load, less with more substeps.
struct DistanceJoint {
  /// In a Scene, only the index is used: the index in Scene::bodies. At least one of the two bodies
  /// must be movable.
  BodyId a{};
  std::optional<BodyId> b{};  ///< absent: the world
  /// [m], points of the bodies in body axes, from the centre of mass; if `b` is absent, anchor_b is
  /// in world coordinates. At most 1e9 each.
  Vec3 anchor_a{}, anchor_b{};
  Real min_length = 0;          ///< [m], in [0, max_length]
  Real max_length = Real(1e9);  ///< [m], at most 1e9
  Real rest_length = 0;         ///< [m], in [0, 1e9], of the spring
  /// [Hz], in [0, 1e6], frequency of the spring with the masses of the two bodies; 0: no spring.
  /// Ignored by a rod. Above 0.04 divided by the substep, the spring loses energy.
  Real hertz = 0;
  Real damping_ratio = 0;          ///< [-], in [0, 1000], of the spring; 1: critical
  bool collide_connected = false;  ///< whether the two bodies have contacts with each other
  std::uint64_t user_data = 0;     ///< application data without effect
  friend bool operator==(const DistanceJoint&, const DistanceJoint&) = default;
};

/// Holds two points of two bodies together: three rotations stay free. Limits of the rotations are
/// angles of the joint axes, which coincide when all angles are 0. `axes_a` and `axes_b` rotate the
/// joint axes into the axes of each body; x is the twist axis. place_joint() computes the frames.
/// From -pi to pi, a range has no limits; otherwise pi is a limit, too.
struct BallJoint {
  BodyId a{};                   ///< as in DistanceJoint, and so are the other common fields
  std::optional<BodyId> b{};    ///< absent: the world
  Vec3 anchor_a{}, anchor_b{};  ///< [m], body axes, from the centre of mass
  Quat axes_a{}, axes_b{};      ///< unit quaternions, from joint axes to body axes
  Real cone_angle = kPi;        ///< [rad], in [0, pi], largest angle between the x axes; pi: free
  Real min_twist = -kPi;        ///< [rad], in [-pi, max_twist], of a about x
  Real max_twist = kPi;         ///< [rad], at most pi
  Real hertz = 0;               ///< [Hz], in [0, 1e6], of a spring to all angles 0; 0: none
  Real damping_ratio = 0;       ///< [-], in [0, 1000], of the spring; 1: critical
  Real friction_torque = 0;     ///< [N m], in [0, 1e9], largest torque against rotation
  bool collide_connected = false;  ///< whether the two bodies have contacts with each other
  std::uint64_t user_data = 0;     ///< application data without effect
  friend bool operator==(const BallJoint&, const BallJoint&) = default;
};

/// Lets body a rotate relative to b about the x axis of the joint only. A range from -pi to pi has
/// no limits; otherwise pi is a limit, too.
struct HingeJoint {
  BodyId a{};
  std::optional<BodyId> b{};       ///< absent: the world
  Vec3 anchor_a{}, anchor_b{};     ///< [m], body axes, from the centre of mass
  Quat axes_a{}, axes_b{};         ///< unit quaternions, from joint axes to body axes
  Real min_angle = -kPi;           ///< [rad], in [-pi, max_angle], of a about x
  Real max_angle = kPi;            ///< [rad], at most pi
  Real target_angle = 0;           ///< [rad], in [-pi, pi], of the spring
  Real hertz = 0;                  ///< [Hz], in [0, 1e6], of the spring; 0: none
  Real damping_ratio = 0;          ///< [-], in [0, 1000], of the spring; 1: critical
  Real motor_speed = 0;            ///< [rad/s], of a about x, between -1e6 and 1e6
  Real max_motor_torque = 0;       ///< [N m], in [0, 1e9]; 0: no motor; at speed 0: a brake
  bool collide_connected = false;  ///< whether the two bodies have contacts with each other
  std::uint64_t user_data = 0;     ///< application data without effect
  friend bool operator==(const HingeJoint&, const HingeJoint&) = default;
};

/// Lets body a move relative to b along the x axis of the joint only; neither rotates relative to
/// the other. The axis is fixed in b.
struct SliderJoint {
  BodyId a{};
  std::optional<BodyId> b{};       ///< absent: the world
  Vec3 anchor_a{}, anchor_b{};     ///< [m], body axes, from the centre of mass
  Quat axes_a{}, axes_b{};         ///< unit quaternions, from joint axes to body axes
  Real min_position = Real(-1e9);  ///< [m], in [-1e9, max_position], of a's anchor along x
  Real max_position = Real(1e9);   ///< [m], at most 1e9
  Real target_position = 0;        ///< [m], between -1e9 and 1e9, of the spring
  Real hertz = 0;                  ///< [Hz], in [0, 1e6], of the spring; 0: none
  Real damping_ratio = 0;          ///< [-], in [0, 1000], of the spring; 1: critical
  Real motor_speed = 0;            ///< [m/s], of a along x, between -1e6 and 1e6
  Real max_motor_force = 0;        ///< [N], in [0, 1e9]; 0: no motor; at speed 0: a brake
  bool collide_connected = false;  ///< whether the two bodies have contacts with each other
  std::uint64_t user_data = 0;     ///< application data without effect
  friend bool operator==(const SliderJoint&, const SliderJoint&) = default;
};

/// Keeps two bodies in the relative pose in which their joint frames coincide.
struct FixedJoint {
  BodyId a{};
  std::optional<BodyId> b{};    ///< absent: the world
  Vec3 anchor_a{}, anchor_b{};  ///< [m], body axes, from the centre of mass
  Quat axes_a{}, axes_b{};      ///< unit quaternions, from joint axes to body axes
  Real linear_hertz = 0;        ///< [Hz], in [0, 1e6], of a spring that holds the points; 0: rigid
  Real angular_hertz = 0;       ///< [Hz], in [0, 1e6], of a spring that holds the axes; 0: rigid
  Real damping_ratio = 0;       ///< [-], in [0, 1000], of the springs; 1: critical
  bool collide_connected = false;  ///< whether the two bodies have contacts with each other
  std::uint64_t user_data = 0;     ///< application data without effect
  friend bool operator==(const FixedJoint&, const FixedJoint&) = default;
};

/// Holds a wheel a on a vehicle b. The wheel rotates about the x axis of the joint, and moves along
/// its y axis, the direction of the suspension. The axes are fixed in b, except for the
/// steering, which turns x about y.
struct WheelJoint {
  BodyId a{};
  std::optional<BodyId> b{};       ///< absent: the world
  Vec3 anchor_a{}, anchor_b{};     ///< [m], body axes, from the centre of mass
  Quat axes_a{}, axes_b{};         ///< unit quaternions, from joint axes to body axes
  Real min_position = Real(-1e9);  ///< [m], in [-1e9, max_position], of the wheel along y
  Real max_position = Real(1e9);   ///< [m], at most 1e9
  Real hertz = 0;                  ///< [Hz], in [0, 1e6], of the suspension to position 0; 0: none
  Real damping_ratio = 0;          ///< [-], in [0, 1000], of the suspension; 1: critical
  Real steering_angle = 0;         ///< [rad], in [-pi, pi], about y
  Real motor_speed = 0;            ///< [rad/s], of the wheel about x, between -1e6 and 1e6
  Real max_motor_torque = 0;       ///< [N m], in [0, 1e9]; 0: no motor; at speed 0: a brake
  bool collide_connected = false;  ///< whether the two bodies have contacts with each other
  std::uint64_t user_data = 0;     ///< application data without effect
  friend bool operator==(const WheelJoint&, const WheelJoint&) = default;
};

/// A joint of any type.
using Joint =
    std::variant<DistanceJoint, BallJoint, HingeJoint, SliderJoint, FixedJoint, WheelJoint>;

/// A joint after the last step. Forces are means over the last substep.
struct JointState {
  Vec3 point_a, point_b;  ///< [m], anchors in world coordinates
  Real length = 0;        ///< [m], their distance
  /// [N], of a DistanceJoint: along the line of the anchors; > 0: pulls the bodies together
  Real tension = 0;
  Vec3 force;   ///< [N], world axes, on a at point_a; b has the opposite one there
  Vec3 torque;  ///< [N m], world axes, on a in addition to that of the force
  /// [m] or [rad], of a relative to b: length of a DistanceJoint, angle in [-pi, pi] of a
  /// HingeJoint, position of a SliderJoint or a WheelJoint, angle between the x axes of a
  /// BallJoint; 0 of a FixedJoint. Angles have an error of at most 1e-6 rad in float.
  Real position = 0;
  /// [m/s] or [rad/s], rate of `position`; of a WheelJoint the rate of its rotation. Of a
  /// BallJoint, the relative angular velocity without sign.
  Real speed = 0;
  friend bool operator==(const JointState&, const JointState&) = default;
};

/// Sets the frames of a joint such that it is in its zero position for given poses of its bodies.
/// @param joint any joint with axes
/// @param a, b  poses of the bodies; of the world: BodyState{}
/// @param point [m], world coordinates
/// @param axes  unit, from joint axes to world axes: see axes_along()
template <class J>
void place_joint(J* joint, const BodyState& a, const BodyState& b, const Vec3& point,
                 const Quat& axes) {
  joint->anchor_a = rotate(conjugate(a.orientation), point - a.position);
  joint->anchor_b = rotate(conjugate(b.orientation), point - b.position);
  joint->axes_a = conjugate(a.orientation) * axes;
  joint->axes_b = conjugate(b.orientation) * axes;
}
/// @param axis x axis of the joint in world axes, of any length; the y axis is any
/// @throws InvalidArgument
template <class J>
void place_joint(J* joint, const BodyState& a, const BodyState& b, const Vec3& point,
                 const Vec3& axis) {
  place_joint(joint, a, b, point, axes_along(axis));
}

}  // namespace JFPX_ABI
}  // namespace jfpx
