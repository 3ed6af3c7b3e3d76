/// JSON form of a recording's header; jfpx/scene.hpp declares the JSON form of scenes.
#pragma once

#include <jfpx/recording.hpp>

namespace jfpx {
inline namespace JFPX_ABI {

std::string recording_header_to_json(const RecordingHeader& header);
/// Also accepts "x86", the name of the backend "cpu" in version 0.1.
/// @throws InvalidScene if the text is malformed or a field is invalid
RecordingHeader recording_header_from_json(std::string_view text);

}  // namespace JFPX_ABI
}  // namespace jfpx
