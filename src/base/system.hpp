/// What differs between operating systems. system_posix.cpp and system_windows.cpp implement it. A
/// path in a string is UTF-8 on Windows, and the bytes of the file's name elsewhere.
#pragma once

#include <jfpx/config.hpp>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// A path for functions of std::filesystem and file streams.
JFPX_API std::filesystem::path to_path(const std::string& text);
/// The inverse of to_path().
JFPX_API std::string to_text(const std::filesystem::path& path);

/// std::fopen(). @return null, with errno set, if the file can't be opened
JFPX_API std::FILE* open_file(const std::string& path, const char* mode);

/// The folder for files that can be made again: XDG_CACHE_HOME or .cache in HOME (XDG base
/// directory specification); on Windows, LOCALAPPDATA. Empty if the environment names none, or not
/// by an absolute path.
JFPX_API std::filesystem::path cache_folder();
/// The variable that is missing if cache_folder() is empty, for error messages.
JFPX_API extern const char* const kCacheFolderVariable;

/// Asks for huge pages, where the system takes advice. @param memory aligned to a page
JFPX_API void advise_huge_pages(void* memory, std::size_t bytes) noexcept;
/// [bytes] of memory that the machine has.
JFPX_API std::uint64_t physical_memory() noexcept;

/// Number of cores that the process may use, at least 1: those of its affinity and, on Linux, no
/// more than the CPU quotas of its control groups allow, rounded up. A container with a quota of
/// two cores runs on all cores of its machine, but is stopped when it has used the time of two.
JFPX_API unsigned usable_cores() noexcept;
/// The cores that the quotas of control groups allow (versions 1 and 2), rounded up, at least 1;
/// unlimited: the largest number. @param root folder with proc/self/cgroup and sys/fs/cgroup
JFPX_API unsigned cores_of_quotas(const std::string& root) noexcept;

/// Whether a stream is shown to a person, and moves the cursor by control characters.
JFPX_API bool is_terminal(std::FILE* stream) noexcept;

/// The arguments of the program, after its name. To be called by main() first, once: on Windows,
/// also has the console show UTF-8 until the program ends, and ends lines of stdout as other
/// systems do.
JFPX_API std::vector<std::string> start_program(int argc, char** argv);
/// The file of the running program. @throws std::filesystem::filesystem_error
JFPX_API std::filesystem::path program_path();
/// Runs another program instead of this one, with these arguments after its name, and the standard
/// streams and the exit status of this program. Returns only if it can't be started.
/// @return the reason
JFPX_API std::string run_instead(const std::filesystem::path& program,
                                 const std::vector<std::string>& arguments);

}  // namespace JFPX_ABI
}  // namespace jfpx
