/// Recordings: a header, one frame of raw states per step, and a checksum of the file.
///
/// Layout, little-endian: magic (8 bytes), version and size of Real (4 bytes each), length of the
/// header text (8 bytes), the text (JSON), frames of 13 Reals per body, and at the end the number
/// of frames, the checksum of all preceding bytes, and a closing magic (8 bytes each). In version 2
/// a frame begins with the length of its calls and its number of bodies (8 bytes each) and the
/// calls (JSON).
#include <jfpx/error.hpp>
#include <jfpx/recording.hpp>

#include "src/base/atomic_file.hpp"
#include "src/base/file.hpp"
#include "src/base/hash64.hpp"
#include "src/base/system.hpp"
#include "src/scene/scene_json.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <fstream>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::array<char, 8> kMagic{'J', 'F', 'P', 'X', 'R', 'E', 'C', '\n'};
constexpr std::array<char, 8> kEnd{'J', 'F', 'P', 'X', 'E', 'N', 'D', '\n'};
constexpr std::uint32_t kVersion = 1, kVersionWithCalls = 2;
constexpr std::size_t kRealsPerBody = 13;
constexpr std::size_t kPrefixSize = 24;
constexpr std::size_t kTrailerSize = 24;
/// Frames without bodies are empty, so the file size does not limit the claimed number of frames.
constexpr std::uint64_t kMaxEmptyFrames = 10'000'000;

static_assert(sizeof(BodyState) == kRealsPerBody * sizeof(Real), "a state has no padding");

/// Names of the numbers of a BodyState.
constexpr const char* kNames[kRealsPerBody] = {
    "position.x",        "position.y",    "position.z",         "orientation.w",
    "orientation.x",     "orientation.y", "orientation.z",      "velocity.x",
    "velocity.y",        "velocity.z",    "angular_velocity.x", "angular_velocity.y",
    "angular_velocity.z"};

struct Prefix {
  std::array<char, 8> magic = kMagic;
  std::uint32_t version = kVersion;
  std::uint32_t real_size = sizeof(Real);
  std::uint64_t header_size = 0;
};
static_assert(sizeof(Prefix) == kPrefixSize);

/// Beginning of a frame with calls.
struct FrameHead {
  std::uint64_t calls = 0;  ///< [bytes]
  std::uint64_t bodies = 0;
};

struct Trailer {
  std::uint64_t frames = 0;
  std::uint64_t checksum = 0;
  std::array<char, 8> end = kEnd;
};
static_assert(sizeof(Trailer) == kTrailerSize);

Prefix read_prefix(std::ifstream& file, const std::string& path) {
  if (!file) throw FileError(file_message(path, "can't be opened", errno));
  Prefix prefix;
  file.read(reinterpret_cast<char*>(&prefix), sizeof prefix);
  if (!file || prefix.magic != kMagic) throw FileError(path + ": is not a jfpx recording");
  if (prefix.version != kVersion && prefix.version != kVersionWithCalls) {
    throw FileError(path + ": is a recording of version " + std::to_string(prefix.version) +
                    "; this build reads versions " + std::to_string(kVersion) + " and " +
                    std::to_string(kVersionWithCalls));
  }
  if (prefix.real_size != sizeof(float) && prefix.real_size != sizeof(double)) {
    throw FileError(path + ": is corrupt: its numbers have " + std::to_string(prefix.real_size) +
                    " bytes; it must be 4 or 8");
  }
  return prefix;
}

const char* precision_name(std::uint32_t real_size) {
  return real_size == sizeof(float) ? "float" : "double";
}

}  // namespace

struct RecordingWriter::Impl {
  Impl(const std::string& path, std::size_t body_count) : file(path), bodies(body_count) {}

  void write(const void* data, std::size_t size) {
    hash.add_bytes(data, size);
    file.write({static_cast<const char*>(data), size});
  }

  AtomicFile file;
  Hash64 hash;
  std::size_t bodies;
  std::uint64_t frames = 0;
};

RecordingWriter::RecordingWriter(const std::string& path, const RecordingHeader& header)
    : RecordingWriter(path, header, false) {}

RecordingWriter::RecordingWriter(const std::string& path, const RecordingHeader& header,
                                 bool with_calls)
    : impl_(std::make_unique<Impl>(path, header.scene.bodies.size())) {
  const std::string text = recording_header_to_json(header);
  Prefix prefix;
  prefix.version = with_calls ? kVersionWithCalls : kVersion;
  prefix.header_size = text.size();
  impl_->write(&prefix, sizeof prefix);
  impl_->write(text.data(), text.size());
}

RecordingWriter::~RecordingWriter() = default;
RecordingWriter::RecordingWriter(RecordingWriter&&) noexcept = default;
RecordingWriter& RecordingWriter::operator=(RecordingWriter&&) noexcept = default;

void RecordingWriter::append(std::span<const BodyState> states) {
  if (states.size() != impl_->bodies) {
    throw InvalidArgument("a frame has " + std::to_string(states.size()) +
                          " bodies; the recorded scene has " + std::to_string(impl_->bodies));
  }
  if (states.empty() && impl_->frames == kMaxEmptyFrames) {
    throw InvalidArgument("a recording without bodies has at most " +
                          std::to_string(kMaxEmptyFrames) + " frames");
  }
  impl_->write(states.data(), states.size_bytes());
  ++impl_->frames;
}

void RecordingWriter::append(std::span<const BodyState> states, const std::string& calls) {
  const FrameHead head{.calls = calls.size(), .bodies = states.size()};
  impl_->write(&head, sizeof head);
  impl_->write(calls.data(), calls.size());
  impl_->write(states.data(), states.size_bytes());
  ++impl_->frames;
}

void RecordingWriter::finish() {
  Impl& impl = *impl_;
  impl.hash.add_word(impl.frames);
  const Trailer trailer{.frames = impl.frames, .checksum = impl.hash.value()};
  impl.file.write({reinterpret_cast<const char*>(&trailer), sizeof trailer});
  impl.file.finish();
}

struct RecordingReader::Impl {
  struct Frame {
    std::uint64_t offset;  ///< of its calls in the file
    FrameHead head;
  };

  std::string path;
  std::ifstream file;
  RecordingHeader header;
  std::uint64_t frames = 0;
  std::uint64_t first_frame = 0;  ///< offset of the first frame in the file
  std::size_t frame_size = 0;     ///< without calls: of each frame
  std::vector<Frame> with_calls;  ///< the frames, if they may have calls
  std::vector<char> content;      ///< of a frame

  [[noreturn]] void fail(const std::string& what) const { throw FileError(path + ": " + what); }
  [[noreturn]] void fail_corrupt() const {
    fail("is corrupt: its checksum does not match its content");
  }

  std::uint64_t file_size() {
    file.seekg(0, std::ios::end);
    return static_cast<std::uint64_t>(file.tellg());
  }
  void read_at(std::uint64_t offset, void* data, std::size_t size) {
    file.seekg(static_cast<std::streamoff>(offset));
    file.read(static_cast<char*>(data), static_cast<std::streamsize>(size));
    if (!file) fail("is truncated");
  }
  /// Adds a part of the file to the hash.
  void hash_content(std::uint64_t offset, std::uint64_t size, Hash64* hash) {
    content.resize(size);
    read_at(offset, content.data(), content.size());
    hash->add_bytes(content.data(), content.size());
  }

  void read_frames(std::uint64_t payload, Hash64* hash) {
    if (frames == 0 ? payload != 0 : payload % frames != 0) fail_corrupt();
    frame_size = frames == 0 ? 0 : static_cast<std::size_t>(payload / frames);
    // A scene without bodies: each frame contributed only its length to the hash.
    if (frame_size == 0 && frames > kMaxEmptyFrames) fail_corrupt();
    for (std::uint64_t k = 0; k < frames; ++k) {
      hash_content(first_frame + k * frame_size, frame_size, hash);
    }
  }
  void read_frames_with_calls(std::uint64_t payload, Hash64* hash) {
    std::uint64_t offset = first_frame, left = payload;
    for (std::uint64_t k = 0; k < frames; ++k) {
      FrameHead head;
      if (left < sizeof head) fail_corrupt();
      read_at(offset, &head, sizeof head);
      hash->add_bytes(&head, sizeof head);
      offset += sizeof head, left -= sizeof head;
      if (head.calls > left || head.bodies > (left - head.calls) / sizeof(BodyState)) {
        fail_corrupt();
      }
      with_calls.push_back({offset, head});
      for (const std::uint64_t size : {head.calls, head.bodies * sizeof(BodyState)}) {
        hash_content(offset, size, hash);
        offset += size, left -= size;
      }
    }
    if (left != 0) fail_corrupt();
  }
  void require_step(std::uint64_t step) const {
    if (step >= 1 && step <= frames) return;
    throw InvalidArgument("step is " + std::to_string(step) + "; the recording has steps 1 to " +
                          std::to_string(frames));
  }
};

RecordingReader::RecordingReader(const std::string& path) : impl_(std::make_unique<Impl>()) {
  Impl& impl = *impl_;
  impl.path = path;
  impl.file.open(to_path(path), std::ios::binary);
  const Prefix prefix = read_prefix(impl.file, path);
  if (prefix.real_size != sizeof(Real)) {
    impl.fail(std::string("was recorded in ") + precision_name(prefix.real_size) +
              " precision; this build computes in " + precision_name(sizeof(Real)));
  }
  const std::uint64_t size = impl.file_size();
  if (size < kPrefixSize + kTrailerSize || prefix.header_size > size - kPrefixSize - kTrailerSize) {
    impl.fail("is truncated");
  }
  Trailer trailer;
  impl.read_at(size - sizeof trailer, &trailer, sizeof trailer);
  if (trailer.end != kEnd) impl.fail("is truncated");

  Hash64 hash;
  hash.add_bytes(&prefix, sizeof prefix);
  std::string text(prefix.header_size, '\0');
  impl.read_at(kPrefixSize, text.data(), text.size());
  hash.add_bytes(text.data(), text.size());
  impl.first_frame = kPrefixSize + text.size();
  impl.frames = trailer.frames;
  const bool has_heads = prefix.version == kVersionWithCalls;
  const std::uint64_t payload = size - impl.first_frame - kTrailerSize;
  if (has_heads) {
    impl.read_frames_with_calls(payload, &hash);
  } else {
    impl.read_frames(payload, &hash);
  }
  hash.add_word(trailer.frames);
  if (hash.value() != trailer.checksum) impl.fail_corrupt();
  try {
    impl.header = recording_header_from_json(text);
  } catch (const InvalidScene& error) {
    impl.fail(std::string("is corrupt: ") + error.what());
  }
  const std::size_t of_scene = impl.header.scene.bodies.size() * sizeof(BodyState);
  bool fits = has_heads || impl.frames == 0 || impl.frame_size == of_scene;
  for (const Impl::Frame& frame : impl.with_calls) {
    if (frame.head.calls > 0) break;
    fits = fits && frame.head.bodies == impl.header.scene.bodies.size();
  }
  if (!fits) impl.fail("is corrupt: its frames do not fit its scene");
}

RecordingReader::~RecordingReader() = default;
RecordingReader::RecordingReader(RecordingReader&&) noexcept = default;
RecordingReader& RecordingReader::operator=(RecordingReader&&) noexcept = default;

const RecordingHeader& RecordingReader::header() const { return impl_->header; }
std::uint64_t RecordingReader::steps() const { return impl_->frames; }

std::vector<BodyState> RecordingReader::states(std::uint64_t step) {
  impl_->require_step(step);
  std::uint64_t offset = impl_->first_frame + (step - 1) * impl_->frame_size;
  std::size_t bodies = impl_->header.scene.bodies.size();
  if (!impl_->with_calls.empty()) {
    const Impl::Frame& frame = impl_->with_calls[step - 1];
    offset = frame.offset + frame.head.calls;
    bodies = frame.head.bodies;
  }
  std::vector<BodyState> states(bodies);
  impl_->read_at(offset, states.data(), bodies * sizeof(BodyState));
  return states;
}

bool RecordingReader::has_calls() const {
  return std::ranges::any_of(impl_->with_calls, [](const auto& f) { return f.head.calls > 0; });
}

std::string RecordingReader::calls(std::uint64_t step) {
  impl_->require_step(step);
  if (impl_->with_calls.empty()) return {};
  const Impl::Frame& frame = impl_->with_calls[step - 1];
  std::string calls(frame.head.calls, '\0');
  impl_->read_at(frame.offset, calls.data(), calls.size());
  return calls;
}

std::string recording_precision(const std::string& path) {
  std::ifstream file(to_path(path), std::ios::binary);
  return precision_name(read_prefix(file, path).real_size);
}

std::optional<StateDifference> first_difference(std::span<const BodyState> expected,
                                                std::span<const BodyState> actual) {
  const std::size_t common = std::min(expected.size(), actual.size());
  for (std::size_t body = 0; body < common; ++body) {
    // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): compares bits on purpose
    if (std::memcmp(&expected[body], &actual[body], sizeof(BodyState)) == 0) continue;
    Real e[kRealsPerBody], a[kRealsPerBody];
    std::memcpy(e, &expected[body], sizeof e);
    std::memcpy(a, &actual[body], sizeof a);
    for (std::size_t k = 0; k < kRealsPerBody; ++k) {
      // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): compares bits on purpose
      if (std::memcmp(&e[k], &a[k], sizeof(Real)) != 0) {
        return StateDifference{static_cast<std::uint32_t>(body), kNames[k], e[k], a[k]};
      }
    }
  }
  if (expected.size() == actual.size()) return std::nullopt;
  return StateDifference{static_cast<std::uint32_t>(common), "existence",
                         static_cast<Real>(expected.size() > common),
                         static_cast<Real>(actual.size() > common)};
}

}  // namespace JFPX_ABI
}  // namespace jfpx
