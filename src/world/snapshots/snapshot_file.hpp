/// Header and checksum of a snapshot.
#pragma once

#include <jfpx/snapshot.hpp>

#include "src/base/binary_archive.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

/// Writes the header; the content must follow.
void start_snapshot(BinaryWriter* writer);
/// Completes the header and adds the checksum.
/// @param writer has written header and content
/// @param has_joints whether the content has the joints of version 2
Snapshot finish_snapshot(BinaryWriter* writer, bool has_joints);
/// A reader of the content. @throws InvalidSnapshot if header or checksum are not valid
BinaryReader open_snapshot(const Snapshot& snapshot);

}  // namespace JFPX_ABI
}  // namespace jfpx
