/// Reading and writing of whole files. Errors name the file and the reason.
#pragma once

#include <jfpx/config.hpp>

#include <string>
#include <string_view>

namespace jfpx {
inline namespace JFPX_ABI {

/// The text "PATH: WHAT: REASON", for FileError. The reason describes `error_number`, a value of
/// errno.
JFPX_API std::string file_message(const std::string& path, std::string_view what, int error_number);

/// The content of a file. @throws FileError
JFPX_API std::string read_file(const std::string& path);
/// Creates or replaces a file atomically: see AtomicFile. @throws FileError
JFPX_API void write_file(const std::string& path, std::string_view content);

}  // namespace JFPX_ABI
}  // namespace jfpx
