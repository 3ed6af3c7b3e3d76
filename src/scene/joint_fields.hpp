/// Fields of joints; see field.hpp.
#pragma once

#include <jfpx/joint.hpp>

#include "src/scene/field.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

/// Names of the types of joints in JSON.
template <class T>
inline constexpr const char* kJointName = nullptr;
template <>
inline constexpr const char* kJointName<DistanceJoint> = "distance";

template <>
inline constexpr const char* kJointName<BallJoint> = "ball";
template <>
inline constexpr const char* kJointName<HingeJoint> = "hinge";
template <>
inline constexpr const char* kJointName<SliderJoint> = "slider";
template <>
inline constexpr const char* kJointName<FixedJoint> = "fixed";
template <>
inline constexpr const char* kJointName<WheelJoint> = "wheel";

inline constexpr Interval kHertz{0, Real(1e6), "in [0, 1e6]"};
inline constexpr Interval kDampingRatio{0, 1000, "in [0, 1000]"};
/// Pi of the other precision is valid, too.
inline constexpr Real kHalfTurn = Real(3.1416);
inline constexpr Interval kHalfTurns{-kHalfTurn, kHalfTurn, "in [-pi, pi]"};
inline constexpr Interval kMotorSpeed{Real(-1e6), Real(1e6), "between -1e6 and 1e6"};
inline constexpr Interval kMotorLimit{0, Real(1e9), "in [0, 1e9]"};

/// The fields that all joints with frames have, before and after those of a type.
void each_frame_field(auto& a, auto& b, auto& anchor_a, auto& anchor_b, auto& axes_a, auto& axes_b,
                      const auto& visit) {
  visit(required_field("a"), a);
  visit(newer_field("b"), b);
  visit(field("anchor_a", kInWorld), anchor_a);
  visit(field("anchor_b", kInWorld), anchor_b);
  visit(field("axes_a", kUnitQuaternion), axes_a);
  visit(field("axes_b", kUnitQuaternion), axes_b);
}
void each_last_field(auto& collide_connected, auto& user_data, const auto& visit) {
  visit(field("collide_connected"), collide_connected);
  visit(newer_field("user_data"), user_data);
}

void each_field(Is<DistanceJoint> auto& joint, const auto& visit) {
  constexpr Interval kLength{0, kMaxCoordinate, "in [0, 1e9]"};
  auto& [a, b, anchor_a, anchor_b, min_length, max_length, rest_length, hertz, damping_ratio,
         collide_connected, user_data] = joint;
  visit(required_field("a"), a);
  visit(newer_field("b"), b);
  visit(field("anchor_a", kInWorld), anchor_a);
  visit(field("anchor_b", kInWorld), anchor_b);
  visit(field("min_length", kLength), min_length);
  visit(field("max_length", kLength), max_length);
  visit(field("rest_length", kLength), rest_length);
  visit(field("hertz", kHertz), hertz);
  visit(field("damping_ratio", kDampingRatio), damping_ratio);
  each_last_field(collide_connected, user_data, visit);
}

void each_field(Is<BallJoint> auto& joint, const auto& visit) {
  auto& [a, b, anchor_a, anchor_b, axes_a, axes_b, cone_angle, min_twist, max_twist, hertz,
         damping_ratio, friction_torque, collide_connected, user_data] = joint;
  each_frame_field(a, b, anchor_a, anchor_b, axes_a, axes_b, visit);
  visit(field("cone_angle", Interval{0, kHalfTurn, "in [0, pi]"}), cone_angle);
  visit(field("min_twist", kHalfTurns), min_twist);
  visit(field("max_twist", kHalfTurns), max_twist);
  visit(field("hertz", kHertz), hertz);
  visit(field("damping_ratio", kDampingRatio), damping_ratio);
  visit(field("friction_torque", kMotorLimit), friction_torque);
  each_last_field(collide_connected, user_data, visit);
}

void each_field(Is<HingeJoint> auto& joint, const auto& visit) {
  auto& [a, b, anchor_a, anchor_b, axes_a, axes_b, min_angle, max_angle, target_angle, hertz,
         damping_ratio, motor_speed, max_motor_torque, collide_connected, user_data] = joint;
  each_frame_field(a, b, anchor_a, anchor_b, axes_a, axes_b, visit);
  visit(field("min_angle", kHalfTurns), min_angle);
  visit(field("max_angle", kHalfTurns), max_angle);
  visit(field("target_angle", kHalfTurns), target_angle);
  visit(field("hertz", kHertz), hertz);
  visit(field("damping_ratio", kDampingRatio), damping_ratio);
  visit(field("motor_speed", kMotorSpeed), motor_speed);
  visit(field("max_motor_torque", kMotorLimit), max_motor_torque);
  each_last_field(collide_connected, user_data, visit);
}

void each_field(Is<SliderJoint> auto& joint, const auto& visit) {
  auto& [a, b, anchor_a, anchor_b, axes_a, axes_b, min_position, max_position, target_position,
         hertz, damping_ratio, motor_speed, max_motor_force, collide_connected, user_data] = joint;
  each_frame_field(a, b, anchor_a, anchor_b, axes_a, axes_b, visit);
  visit(field("min_position", kInWorld), min_position);
  visit(field("max_position", kInWorld), max_position);
  visit(field("target_position", kInWorld), target_position);
  visit(field("hertz", kHertz), hertz);
  visit(field("damping_ratio", kDampingRatio), damping_ratio);
  visit(field("motor_speed", kMotorSpeed), motor_speed);
  visit(field("max_motor_force", kMotorLimit), max_motor_force);
  each_last_field(collide_connected, user_data, visit);
}

void each_field(Is<FixedJoint> auto& joint, const auto& visit) {
  auto& [a, b, anchor_a, anchor_b, axes_a, axes_b, linear_hertz, angular_hertz, damping_ratio,
         collide_connected, user_data] = joint;
  each_frame_field(a, b, anchor_a, anchor_b, axes_a, axes_b, visit);
  visit(field("linear_hertz", kHertz), linear_hertz);
  visit(field("angular_hertz", kHertz), angular_hertz);
  visit(field("damping_ratio", kDampingRatio), damping_ratio);
  each_last_field(collide_connected, user_data, visit);
}

void each_field(Is<WheelJoint> auto& joint, const auto& visit) {
  auto& [a, b, anchor_a, anchor_b, axes_a, axes_b, min_position, max_position, hertz, damping_ratio,
         steering_angle, motor_speed, max_motor_torque, collide_connected, user_data] = joint;
  each_frame_field(a, b, anchor_a, anchor_b, axes_a, axes_b, visit);
  visit(field("min_position", kInWorld), min_position);
  visit(field("max_position", kInWorld), max_position);
  visit(field("hertz", kHertz), hertz);
  visit(field("damping_ratio", kDampingRatio), damping_ratio);
  visit(field("steering_angle", kHalfTurns), steering_angle);
  visit(field("motor_speed", kMotorSpeed), motor_speed);
  visit(field("max_motor_torque", kMotorLimit), max_motor_torque);
  each_last_field(collide_connected, user_data, visit);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
