/// The joints in a snapshot.
#pragma once

#include "src/base/binary_archive.hpp"
#include "src/contact_solver/soft_step/contact_set.hpp"
#include "src/world/body_store.hpp"
#include "src/world/joint_store.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

/// Writes the joints, their ids, and what they keep.
void write_joints(BinaryWriter* writer, const JointStore& joints);
/// Reads joints of the bodies, and sets the pairs of bodies that do not collide because of them.
/// @param contacts of the last step
/// @throws InvalidSnapshot, std::bad_alloc
JointStore read_joints(BinaryReader* reader, const soft_step::ContactSet& contacts,
                       BodyStore* bodies);

}  // namespace JFPX_ABI
}  // namespace jfpx
