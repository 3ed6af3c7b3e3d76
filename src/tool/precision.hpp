/// Switching between the float and the double build of the command.
#pragma once

#include <jfpx/config.hpp>

#include <string_view>

namespace jfpx::inline JFPX_ABI::tool {

/// What this build computes in, as --precision calls it.
inline constexpr std::string_view kPrecision = sizeof(Real) == 4 ? "float" : "double";

/// Runs the other build in this process' place when the arguments ask for the other precision:
/// by --precision, or by naming a recording of it. Returns if this build is the right one.
/// Bullet's float and double libraries export the same symbols, so one process can't hold both.
/// @throws Error if the other build is not beside this one; FileError for a broken recording.
void switch_precision_if_asked(int argc, char** argv);

}  // namespace jfpx::inline JFPX_ABI::tool
