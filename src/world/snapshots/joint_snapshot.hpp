/// The joints in a snapshot.
#pragma once

#include "src/base/binary_archive.hpp"
#include "src/world/bodies/body_store.hpp"
#include "src/world/joints/joint_store.hpp"
#include "src/world/snapshots/snapshot_checks.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

/// Writes the joints, their ids, impulses and colors.
void write_joints(BinaryWriter* writer, const JointStore& joints);
/// Reads joints of the bodies, and sets the pairs of bodies that do not collide because of them.
/// @param colors of the contacts; receives the colors of the joints
/// @throws InvalidSnapshot, std::bad_alloc
JointStore read_joints(BinaryReader* reader, SnapshotColors* colors, BodyStore* bodies);

}  // namespace JFPX_ABI
}  // namespace jfpx
