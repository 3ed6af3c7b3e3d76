/// Switching between the float and the double build of the command.
#pragma once

#include <jfpx/config.hpp>

#include <string>
#include <string_view>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

/// What this build computes in, as --precision calls it.
inline constexpr std::string_view kPrecision = sizeof(Real) == 4 ? "float" : "double";

/// Runs the build of that precision, "float" or "double", with the same arguments in this process'
/// place. Returns if that is this one, or there is no such precision.
/// Bullet's float and double libraries export the same symbols, so one process can't hold both.
/// @throws Error if the other build is not beside this one.
void switch_precision(const std::string& precision, char** argv);
/// The same, when the arguments ask for the other precision: by --precision, or by `replay` of a
/// recording of it. @throws FileError for a broken recording, too.
void switch_precision_if_asked(int argc, char** argv);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
