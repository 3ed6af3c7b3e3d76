/// Switching between the float and the double build of a program.
#pragma once

#include <jfpx/config.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

/// Precision of this build, as an argument of --precision.
inline constexpr std::string_view kPrecision = sizeof(Real) == 4 ? "float" : "double";

/// Runs the program of the given precision, "float" or "double", instead of this one, with the same
/// arguments (those after the name of the program). Returns if this program has that precision, or
/// if the precision is unknown. Two programs are necessary because Bullet's float and double
/// libraries export the same symbols.
/// @throws Error if the other program is not in the same folder
void switch_precision(const std::string& precision, const std::vector<std::string>& arguments);
/// Calls switch_precision() if the arguments select a precision: by --precision, or by `replay` of
/// a recording. @throws also FileError for an invalid recording
/// @param arguments those after the name of the program; arguments after "--" are ignored
void switch_precision_if_requested(const std::vector<std::string>& arguments);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
