/// The state of a joint after a step, from the states of its bodies and its impulses.
#pragma once

#include <jfpx/joint.hpp>

#include "src/contact_solver/soft_step/joint_set.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

/// @param a, b states of the bodies; of the world: BodyState{}
/// @param kept impulses of the last substep
/// @param h    [s], length of a substep
JointState joint_state(const Joint& joint, const soft_step::JointInput& input,
                       const soft_step::KeptJoint& kept, const BodyState& a, const BodyState& b,
                       Real h);

}  // namespace JFPX_ABI
}  // namespace jfpx
