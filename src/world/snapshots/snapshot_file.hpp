/// Header and checksum of a snapshot.
#pragma once

#include <jfpx/snapshot.hpp>

#include "src/base/binary_archive.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

/// Parts of the content of a snapshot that only some worlds have.
enum class SnapshotParts : std::uint8_t {
  none,
  joints,
  joints_and_places,  ///< of a world that is or was divided into blocks
  recyclable,         ///< also of a world with contacts of boxes
  frames,             ///< all of these, and of a world with joints that have frames
  locks,              ///< also of a world with bodies that have motion locks
};

/// Writes the header; the content must follow.
void start_snapshot(BinaryWriter* writer);
/// Completes the header and adds the checksum.
/// @param writer has written header and content
/// @param parts parts of the content after those of version 1
Snapshot finish_snapshot(BinaryWriter* writer, SnapshotParts parts);
/// A reader of the content. @throws InvalidSnapshot if header or checksum are not valid
BinaryReader open_snapshot(const Snapshot& snapshot);

}  // namespace JFPX_ABI
}  // namespace jfpx
