/// A run written down: the scene and the state after every step, for replay and comparison.
#pragma once

#include <jfpx/scene.hpp>

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// What a recording says about its run.
struct RecordingHeader {
  std::string engine;   ///< "native", "bullet" or "bullet-stock"
  std::string backend;  ///< as to_string(Backend)
  Scene scene;
  friend bool operator==(const RecordingHeader&, const RecordingHeader&) = default;
};

/// Writes a recording frame by frame. The file appears under its name only at finish(), complete;
/// before that it lies beside it as NAME.part, which the destructor removes. Not thread-safe.
class JFPX_API RecordingWriter {
 public:
  /// @throws FileError if the file can't be made.
  RecordingWriter(const std::string& path, const RecordingHeader& header);
  ~RecordingWriter();
  RecordingWriter(RecordingWriter&&) noexcept;
  RecordingWriter& operator=(RecordingWriter&&) noexcept;

  /// The states of all bodies after the next step, in scene order.
  /// @throws InvalidArgument if their number is not the scene's; FileError if the disk is full.
  void append(std::span<const BodyState> states);
  /// Completes the file. @throws FileError
  void finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Reads a recording. The whole file is checked when it is opened. Not thread-safe.
class JFPX_API RecordingReader {
 public:
  /// @throws FileError if the file can't be read, is no recording, is of another version or
  ///   precision, is truncated, or its checksum is wrong.
  explicit RecordingReader(const std::string& path);
  ~RecordingReader();
  RecordingReader(RecordingReader&&) noexcept;
  RecordingReader& operator=(RecordingReader&&) noexcept;

  const RecordingHeader& header() const;
  std::uint64_t steps() const;
  /// States after step `step`, from 1 to steps(). @throws InvalidArgument out of that range.
  std::vector<BodyState> states(std::uint64_t step);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// "float" or "double": which build wrote the recording. @throws FileError as RecordingReader.
JFPX_API std::string recording_precision(const std::string& path);

/// The first place where two frames differ.
struct StateDifference {
  std::uint32_t body = 0;  ///< position in the scene
  std::string field;       ///< for example "velocity.y"
  Real expected = 0, actual = 0;
};

/// The first body and field in which two frames differ in bits; empty if they are equal. Frames of
/// different lengths differ in the field "existence" of the first body that only one has.
JFPX_API std::optional<StateDifference> first_difference(std::span<const BodyState> expected,
                                                         std::span<const BodyState> actual);

}  // namespace JFPX_ABI
}  // namespace jfpx
