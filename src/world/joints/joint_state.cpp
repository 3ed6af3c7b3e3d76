/// The state of a joint after a step; see the header.
#include "src/world/joints/joint_state.hpp"

#include "src/contact_solver/soft_step/frame_row.hpp"

#include <tuple>
#include <variant>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using soft_step::FramePose;
using soft_step::KeptJoint;

/// A joint with its bodies after a step.
struct JointMotion {
  const soft_step::JointInput& input;
  const KeptJoint& kept;
  const BodyState &a, &b;
  Real inverse_h;  ///< [1/s]

  Vec3 velocity_at(const BodyState& body, const Vec3& point) const {
    return body.velocity + cross(body.angular_velocity, point - body.position);
  }
};

void set_measures(const DistanceJoint&, const JointMotion& motion, JointState* state) {
  const auto [spring, lower, upper] =
      std::tuple{motion.kept.impulses[0], motion.kept.impulses[1], motion.kept.impulses[2]};
  const Vec3 between = state->point_a - state->point_b;
  const Vec3 direction = state->length > kEpsilon ? between * (1 / state->length) : Vec3{1, 0, 0};
  state->tension = (upper - lower - spring) * motion.inverse_h;
  state->force = direction * -state->tension;
  state->position = state->length;
  state->speed = dot(
      motion.velocity_at(motion.a, state->point_a) - motion.velocity_at(motion.b, state->point_b),
      direction);
}

/// Position and speed of a joint with frames, from the velocities of the frame relative to the
/// base, in the axes of the base.
struct FrameMeasure {
  const FramePose& pose;
  Vec3 velocity, angular_velocity;

  void set(const BallJoint&, JointState* state) const {
    state->position = soft_step::angle_of_half(pose.swing_sine(), pose.swing_cosine);
    state->speed = length(angular_velocity);
  }
  void set(const HingeJoint&, JointState* state) const {
    state->position = pose.twist_angle();
    state->speed = angular_velocity.x;
  }
  void set(const SliderJoint&, JointState* state) const {
    state->position = pose.offset.x;
    state->speed = velocity.x;
  }
  void set(const FixedJoint&, JointState*) const {}
  void set(const WheelJoint&, JointState* state) const {
    state->position = pose.offset.y;
    state->speed = angular_velocity.x;
  }
};

void set_measures(const auto& joint, const JointMotion& motion, JointState* state) {
  soft_step::FrameRow row;
  row.anchor_a = motion.input.frames.anchor_a, row.anchor_b = motion.input.frames.anchor_b;
  row.axes_a = motion.input.frames.axes_a, row.axes_b = motion.input.frames.axes_b;
  row.parameters = motion.input.frames.parameters;
  row.parameters.is_plain = 0;  // so that the pose has angles
  const FramePose pose = FramePose::of(row, motion.a.position - motion.b.position,
                                       motion.a.orientation, motion.b.orientation);
  const soft_step::FrameSum sum(motion.input.frames.parameters,
                                soft_step::frame_impulses(motion.kept), pose);
  state->force = sum.impulse * motion.inverse_h;
  state->torque = (sum.twist_frame - cross(pose.arm_frame, sum.impulse)) * motion.inverse_h;
  const Vec3 velocity =
      motion.velocity_at(motion.a, state->point_a) - motion.velocity_at(motion.b, state->point_a);
  const Vec3 turning = motion.a.angular_velocity - motion.b.angular_velocity;
  FrameMeasure{pose, transform_transpose(pose.axes, velocity),
               transform_transpose(pose.axes, turning)}
      .set(joint, state);
}

}  // namespace

JointState joint_state(const Joint& joint, const soft_step::JointInput& input,
                       const KeptJoint& kept, const BodyState& a, const BodyState& b, Real h) {
  return std::visit(
      [&](const auto& j) {
        JointState state;
        state.point_a = to_world_point(a, j.anchor_a);
        state.point_b = to_world_point(b, j.anchor_b);
        state.length = length(state.point_a - state.point_b);
        set_measures(j, {input, kept, a, b, 1 / h}, &state);
        return state;
      },
      joint);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
