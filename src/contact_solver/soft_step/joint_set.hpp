/// Joints of a world for the soft-step solver, with their impulses and colors.
#pragma once

#include <jfpx/joint.hpp>

#include "src/contact_solver/soft_step/contact_set.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// Body b of a joint with the world.
inline constexpr std::uint32_t kWorld = 0xffffffffu;

/// Parameters of a DistanceJoint.
struct DistanceInput {
  Vec3 anchor_a, anchor_b;      ///< [m], body axes; of the world: world axes
  Real min_length, max_length;  ///< [m]
  Real rest_length;             ///< [m], of the spring
  Real spring_rate, damp_rate;  ///< [1/s], angular frequency and twice the damping ratio times it
};

/// Degrees of freedom of a frame relative to its base, along and about the axes of the base.
inline constexpr std::uint32_t kLinearX = 0, kLinearY = 1, kLinearZ = 2, kAngularX = 3, kNoAxis = 6;
/// Sets of degrees of freedom, as bits.
inline constexpr std::uint32_t kAllLinear = 7, kAllAngular = 7 << kAngularX;

/// Constraints of a joint with frames: see frame_row.hpp.
struct FrameParameters {
  std::uint32_t locked = 0;            ///< degrees of freedom that are constant, as bits
  std::uint32_t sprung = 0;            ///< those with a spring, as bits; not locked
  std::uint32_t limited = kNoAxis;     ///< that with limits: a linear one, or kAngularX
  std::uint32_t motor_axis = kNoAxis;  ///< that with a motor: a linear one, or kAngularX
  std::uint32_t has_lower = 0, has_upper = 0, has_cone = 0;
  std::uint32_t is_plain = 0;               ///< whether it only holds two points together
  Real lower = 0, upper = 0;                ///< [m], or sines of half the angles
  Real lower_cosine = 1, upper_cosine = 1;  ///< of half the angles
  Real cone_sine = 0, cone_cosine = 0;      ///< of half the largest angle of the x axes
  Vec3 target_position;                     ///< [m], of the linear springs
  Quat target_twist;                        ///< about x, of the angular springs
  Real linear_rate = 0, angular_rate = 0;   ///< [1/s], angular frequencies of the springs
  Real damping = 0;                         ///< [-], twice the damping ratio
  Real motor_speed = 0;                     ///< [m/s] or [rad/s]
  Real motor_limit = 0;                     ///< [N] or [N m]
  Real friction_torque = 0;                 ///< [N m], of a ball joint, which has no motor
};

/// Impulses of a joint with frames [N s], [N m s], along and about the axes of the base; those that
/// hold two points together have world axes. Those of limits are not negative.
struct FrameImpulses {
  Vec3 linear, angular;  ///< of locked and sprung degrees of freedom
  Vec3 motor;            ///< motor: x only; friction torque
  Real lower = 0, upper = 0, cone = 0;
};

/// Frames of a joint, and its constraints. Body b has the base.
struct FrameInput {
  Vec3 anchor_a, anchor_b;  ///< [m], body axes; of the world: world axes
  Quat axes_a, axes_b;      ///< from joint axes to body axes
  FrameParameters parameters;
};

/// A joint by the slot of its id.
struct JointInput {
  std::uint32_t is_used = 0;   ///< 0: no joint has the slot
  std::uint32_t type = 0;      ///< index of the alternative of Joint
  std::uint32_t a = 0, b = 0;  ///< bodies; b may be kWorld
  std::uint32_t drives = 0;    ///< whether a spring or a motor moves the bodies
  DistanceInput distance{};    ///< of a DistanceJoint
  FrameInput frames{};         ///< of the others
};

/// Values of a joint for the warm start of the next step: impulses of the last substep [N s], whose
/// meaning depends on the type of row, and the color.
struct KeptJoint {
  static constexpr std::uint32_t kMostImpulses = 12;
  Real impulses[kMostImpulses] = {};
  std::uint32_t color = 255;  ///< kNoColor
  std::uint32_t unused = 0;   ///< instead of padding
  friend bool operator==(const KeptJoint&, const KeptJoint&) = default;
};

/// The impulses of a joint with frames.
JFPX_HD inline FrameImpulses frame_impulses(const KeptJoint& kept) {
  const Real* k = kept.impulses;
  return {{k[0], k[1], k[2]}, {k[3], k[4], k[5]}, {k[6], k[7], k[8]}, k[9], k[10], k[11]};
}
JFPX_HD inline void keep_impulses(const FrameImpulses& from, KeptJoint* to) {
  Real* k = to->impulses;
  for (int i = 0; i < 3; ++i) {
    k[i] = from.linear[i], k[3 + i] = from.angular[i], k[6 + i] = from.motor[i];
  }
  k[9] = from.lower, k[10] = from.upper, k[11] = from.cone;
}

/// The joints of a step, in host memory or on a device, by the slots of their ids.
struct JointView {
  const JointInput* inputs = nullptr;
  const KeptJoint* last = nullptr;  ///< of the last step
  KeptJoint* now = nullptr;         ///< of the step in progress
  std::uint32_t count = 0;          ///< number of slots

  JFPX_HD bool is_used(std::uint32_t joint) const { return inputs[joint].is_used != 0; }
  JFPX_HD ContactKey key(std::uint32_t joint) const {
    return {inputs[joint].a, inputs[joint].b, ContactKey::kJoint, joint};
  }
};

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
