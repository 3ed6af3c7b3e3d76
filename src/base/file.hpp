/// Whole files, with errors that say which file and why.
#pragma once

#include <jfpx/config.hpp>

#include <string>
#include <string_view>

namespace jfpx {
inline namespace JFPX_ABI {

/// `PATH: what: reason from errno`, for FileError.
JFPX_API std::string file_message(const std::string& path, std::string_view what, int error_number);

/// @throws FileError
JFPX_API std::string read_file(const std::string& path);
/// Through an AtomicFile: the file is there whole or not at all. @throws FileError
JFPX_API void write_file(const std::string& path, std::string_view content);

}  // namespace JFPX_ABI
}  // namespace jfpx
