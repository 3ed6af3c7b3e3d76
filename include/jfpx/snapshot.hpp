/// Snapshots of worlds: the state as a value, for rollback, for files and for other machines.
#pragma once

#include <jfpx/config.hpp>

#include <cstddef>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// State of a World, from World::snapshot() for World::restore(). Contains all data that affect the
/// following steps, except user-defined forces and contact generators.
///
/// The bytes have a header with version and precision, and a checksum. They depend on the state
/// only: worlds with the same state have equal snapshots, regardless of the number of threads, the
/// backend and the broad phase.
struct Snapshot {
  std::vector<std::byte> bytes;  ///< the content of a file of save_snapshot()
  friend bool operator==(const Snapshot&, const Snapshot&) = default;
};

/// Writes a snapshot to a file atomically: the path holds the complete file or is unchanged.
/// @throws FileError
JFPX_API void save_snapshot(const Snapshot& snapshot, const std::string& path);
/// Reads a file of save_snapshot(). Checks header and checksum, as World::restore() does.
/// @throws FileError if the file can't be read; InvalidSnapshot, prefixed with the path
JFPX_API Snapshot load_snapshot(const std::string& path);

}  // namespace JFPX_ABI
}  // namespace jfpx
