/// The contacts of the last step in a snapshot.
#pragma once

#include "src/base/binary_archive.hpp"
#include "src/contact_solver/soft_step/contact_set.hpp"
#include "src/world/bodies/body_store.hpp"
#include "src/world/snapshots/snapshot_checks.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

/// Writes the members of the contacts of a completed step that ContactCache::match() reads. Those
/// that recycle() reads follow in write_tests().
void write_contacts(BinaryWriter* writer, const soft_step::ContactSet& contacts);
/// Reads contacts of the bodies; all other members of the contacts are zero.
/// @param colors receives the colors of the contacts
/// @throws InvalidSnapshot, std::bad_alloc
soft_step::ContactSet read_contacts(BinaryReader* reader, const BodyStore& bodies,
                                    SnapshotColors* colors);

/// Whether a contact may be recycled.
bool any_recyclable(const soft_step::ContactSet& contacts);
/// Writes the poses and distances of the last full tests.
void write_tests(BinaryWriter* writer, const soft_step::ContactSet& contacts);
/// Reads what write_tests() has written. @throws InvalidSnapshot, std::bad_alloc
void read_tests(BinaryReader* reader, soft_step::ContactSet* contacts);

}  // namespace JFPX_ABI
}  // namespace jfpx
