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

/// A joint by the slot of its id.
struct JointInput {
  std::uint32_t is_used = 0;   ///< 0: no joint has the slot
  std::uint32_t type = 0;      ///< index of the alternative of Joint
  std::uint32_t a = 0, b = 0;  ///< bodies; b may be kWorld
  DistanceInput distance{};
};

/// Values of a joint for the warm start of the next step: impulses of the last substep [N s], whose
/// meaning depends on the type of row, and the color.
struct KeptJoint {
  static constexpr std::uint32_t kMostImpulses = 3;
  Real impulses[kMostImpulses] = {};
  std::uint32_t color = 255;  ///< kNoColor
  std::uint32_t unused = 0;   ///< instead of padding
  friend bool operator==(const KeptJoint&, const KeptJoint&) = default;
};

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
