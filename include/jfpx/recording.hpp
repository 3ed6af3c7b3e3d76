/// A run written down: the scene and the state after every step, for replay and comparison.
#pragma once

#include <jfpx/scene.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace jfpx::inline JFPX_ABI {

/// A recorded run. `frames[k]` holds the states of all bodies after step k + 1, in scene order.
struct Recording {
  std::string engine;   ///< "native", "bullet" or "bullet-stock"
  std::string backend;  ///< as to_string(Backend)
  Scene scene;
  std::vector<std::vector<BodyState>> frames;
};

/// The first place where two runs differ.
struct StateDifference {
  std::uint64_t step = 0;  ///< from 1
  std::uint32_t body = 0;  ///< position in the scene
  std::string field;       ///< for example "velocity.y"
  Real expected = 0, actual = 0;
};

/// The first body and field in which two frames differ in bits. @param step is only passed on.
JFPX_API std::optional<StateDifference> first_difference(std::span<const BodyState> expected,
                                                         std::span<const BodyState> actual,
                                                         std::uint64_t step);

/// "float" or "double": which build wrote the recording at `path`. @throws FileError
JFPX_API std::string recording_precision(const std::string& path);
/// @throws FileError if the file can't be read, is no recording, is of another version or
///   precision, is truncated, or its checksum is wrong.
JFPX_API Recording load_recording(const std::string& path);
/// Writes all or nothing. @throws FileError
JFPX_API void save_recording(const Recording& recording, const std::string& path);

}  // namespace jfpx::inline JFPX_ABI
