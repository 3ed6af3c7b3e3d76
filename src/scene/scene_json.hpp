/// JSON text of what recordings carry besides the scene.
#pragma once

#include <jfpx/recording.hpp>

namespace jfpx {
inline namespace JFPX_ABI {

std::string recording_header_to_json(const RecordingHeader& header);
/// @throws InvalidScene
RecordingHeader recording_header_from_json(std::string_view text);

}  // namespace JFPX_ABI
}  // namespace jfpx
