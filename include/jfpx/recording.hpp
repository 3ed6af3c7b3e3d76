/// Recordings of runs: the scene, the state after every step, and the calls that changed the world
/// between steps, for replay and comparison.
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

/// Description of the recorded run.
struct RecordingHeader {
  std::string engine;   ///< "native", "bullet" or "bullet-stock"
  std::string backend;  ///< name given by to_string(Backend)
  Scene scene;
  friend bool operator==(const RecordingHeader&, const RecordingHeader&) = default;
};

/// Writes the states of a run frame by frame. Replay steps the scene without changes: use
/// RecordedWorld (recorded_world.hpp) for a run that adds or removes bodies, or has forces.
/// finish() creates the complete file under its name; until then the data are in NAME.part in the
/// same folder, which the destructor removes. Not thread-safe.
class JFPX_API RecordingWriter {
 public:
  /// @throws FileError if the file cannot be created
  RecordingWriter(const std::string& path, const RecordingHeader& header);
  ~RecordingWriter();
  RecordingWriter(RecordingWriter&&) noexcept;
  RecordingWriter& operator=(RecordingWriter&&) noexcept;

  /// Appends the states of all bodies after the next step, in scene order.
  /// @throws InvalidArgument for another number of bodies than the scene's; FileError if the disk
  /// is
  ///   full
  void append(std::span<const BodyState> states);
  /// Completes the file. @throws FileError
  void finish();

 private:
  friend class RecordedWorld;
  /// @param with_calls selects the format whose frames have calls and any number of bodies
  RecordingWriter(const std::string& path, const RecordingHeader& header, bool with_calls);
  void append(std::span<const BodyState> states, const std::string& calls);

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Reads a recording. The constructor checks the whole file. Not thread-safe.
class JFPX_API RecordingReader {
 public:
  /// @throws FileError if the file cannot be read, is not a recording, is of another version or
  ///   precision, is truncated, or has a wrong checksum
  explicit RecordingReader(const std::string& path);
  ~RecordingReader();
  RecordingReader(RecordingReader&&) noexcept;
  RecordingReader& operator=(RecordingReader&&) noexcept;

  const RecordingHeader& header() const;
  std::uint64_t steps() const;  ///< number of recorded steps
  /// States after step `step`, from 1 to steps(). @throws InvalidArgument outside that range
  std::vector<BodyState> states(std::uint64_t step);
  /// Whether any frame has calls; see repeat_calls() in recorded_world.hpp. If not, all frames have
  /// the bodies of the scene.
  bool has_calls() const;
  /// Calls before step `step`, as JSON; empty if there are none.
  /// @throws InvalidArgument outside 1 to steps()
  std::string calls(std::uint64_t step);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Precision of the build that wrote the recording: "float" or "double".
/// @throws FileError if the file cannot be read or is not a recording of this version
JFPX_API std::string recording_precision(const std::string& path);

/// First difference of two frames.
struct StateDifference {
  std::uint32_t body = 0;  ///< index in the scene
  std::string field;       ///< for example "velocity.y"
  Real expected = 0, actual = 0;
};

/// The first body and field whose bits differ in two frames; empty if the frames are equal. Frames
/// of different lengths differ in the field "existence" of the first body that only one contains.
JFPX_API std::optional<StateDifference> first_difference(std::span<const BodyState> expected,
                                                         std::span<const BodyState> actual);

}  // namespace JFPX_ABI
}  // namespace jfpx
