/// Snapshots as bytes and files.
///
/// Layout, little-endian: magic (8 bytes), version and size of Real (4 bytes each), length of the
/// content (8 bytes), the content, and the checksum of all preceding bytes (8 bytes). A change of
/// the content requires another version. Version 2 has joints after the content of version 1, and
/// version 3 the places of bodies in the partition into blocks after them, and version 4 what
/// recycle() reads of the contacts of boxes. Version 5 has the joints that have frames, and version
/// 6 the motion locks of bodies after all others. A world that never had these has snapshots of
/// version 1.
#include "src/world/snapshots/snapshot_file.hpp"

#include "src/base/file.hpp"
#include "src/base/hash64.hpp"

#include <array>
#include <string>
#include <string_view>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

constexpr std::array<char, 8> kMagic{'J', 'F', 'P', 'X', 'S', 'N', 'P', '\n'};
constexpr std::uint32_t kVersion = 1, kLatestVersion = 6;

struct Header {
  std::array<char, 8> magic = kMagic;
  std::uint32_t version = kVersion;
  std::uint32_t real_size = sizeof(Real);
  std::uint64_t content_size = 0;
};
static_assert(sizeof(Header) == 24);

constexpr std::size_t kChecksumSize = sizeof(std::uint64_t);

std::uint64_t checksum(std::span<const std::byte> bytes) {
  Hash64 hash;
  hash.add_bytes(bytes.data(), bytes.size());
  return hash.value();
}

std::string precision_name(std::uint32_t real_size) {
  if (real_size == sizeof(float)) return "float32 (single precision)";
  if (real_size == sizeof(double)) return "float64 (double precision)";
  return "of numbers of " + std::to_string(real_size) + " bytes";
}

[[noreturn]] void fail(const std::string& what) { throw InvalidSnapshot("the snapshot " + what); }

/// @throws InvalidSnapshot
void check(std::span<const std::byte> bytes) {
  Header header;
  if (bytes.size() >= sizeof header) std::memcpy(&header, bytes.data(), sizeof header);
  if (bytes.size() < sizeof header || header.magic != kMagic) {
    throw InvalidSnapshot("this is not a snapshot of jfpx, or it is truncated");
  }
  if (header.version < kVersion || header.version > kLatestVersion) {
    fail("is of version " + std::to_string(header.version) + "; this build reads versions " +
         std::to_string(kVersion) + " to " + std::to_string(kLatestVersion));
  }
  if (header.real_size != sizeof(Real)) {
    fail("is " + precision_name(header.real_size) + "; it must be " + precision_name(sizeof(Real)));
  }
  const std::size_t rest = bytes.size() - sizeof header;
  if (rest < kChecksumSize || rest - kChecksumSize != header.content_size) {
    fail("has " + std::to_string(bytes.size()) + " bytes; its header announces " +
         std::to_string(header.content_size) + " plus " +
         std::to_string(sizeof header + kChecksumSize) + ", so it may be truncated");
  }
  std::uint64_t expected = 0;
  const std::span<const std::byte> end = bytes.last(kChecksumSize);
  std::memcpy(&expected, end.data(), sizeof expected);
  if (checksum(bytes.first(bytes.size() - kChecksumSize)) != expected) {
    fail("is corrupt: its checksum does not match its content");
  }
}

}  // namespace

void start_snapshot(BinaryWriter* writer) {
  for (const std::byte byte : std::bit_cast<std::array<std::byte, sizeof(Header)>>(Header())) {
    (*writer)(byte);
  }
}

Snapshot finish_snapshot(BinaryWriter* writer, SnapshotParts parts) {
  Snapshot snapshot{writer->take()};
  std::vector<std::byte>& bytes = snapshot.bytes;
  Header header;
  header.version = kVersion + static_cast<std::uint32_t>(parts);
  header.content_size = bytes.size() - sizeof header;
  std::memcpy(bytes.data(), &header, sizeof header);
  const auto sum = std::bit_cast<std::array<std::byte, kChecksumSize>>(checksum(bytes));
  bytes.insert(bytes.end(), sum.begin(), sum.end());
  return snapshot;
}

BinaryReader open_snapshot(const Snapshot& snapshot) {
  const std::span<const std::byte> bytes = snapshot.bytes;
  check(bytes);
  return BinaryReader(bytes.subspan(sizeof(Header), bytes.size() - sizeof(Header) - kChecksumSize));
}

void save_snapshot(const Snapshot& snapshot, const std::string& path) {
  write_file(path, {reinterpret_cast<const char*>(snapshot.bytes.data()), snapshot.bytes.size()});
}

Snapshot load_snapshot(const std::string& path) {
  const std::string content = read_file(path);
  const std::span<const std::byte> bytes = std::as_bytes(std::span(content));
  try {
    check(bytes);
  } catch (const InvalidSnapshot& error) {
    throw InvalidSnapshot(path + ": " + error.what());
  }
  return {{bytes.begin(), bytes.end()}};
}

}  // namespace JFPX_ABI
}  // namespace jfpx
