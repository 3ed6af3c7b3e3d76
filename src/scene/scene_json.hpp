/// JSON form of a recording's header.
#pragma once

#include <jfpx/recording.hpp>

namespace jfpx {
inline namespace JFPX_ABI {

std::string recording_header_to_json(const RecordingHeader& header);
/// Reads the backend "x86" of version 0.1 as "cpu". @throws InvalidScene
RecordingHeader recording_header_from_json(std::string_view text);

}  // namespace JFPX_ABI
}  // namespace jfpx
