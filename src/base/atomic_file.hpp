/// Atomic file writer: the file appears under its path only when it is complete.
#pragma once

#include <jfpx/config.hpp>

#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>

namespace jfpx {
inline namespace JFPX_ABI {

/// True if the path exists and is not a regular file, so that renaming a file to it would destroy
/// it.
JFPX_API bool is_special(const std::filesystem::path& path);
/// Target of a chain of symbolic links, which need not exist.
JFPX_API std::filesystem::path follow_links(std::filesystem::path path);

/// Writes to a temporary file beside its path and renames it in finish(), so that readers see
/// either the complete file or none. The destructor removes an unfinished file. A symbolic link is
/// kept, and its target is replaced. Devices and pipes can't be replaced and are written directly.
class JFPX_API AtomicFile {
 public:
  /// Opens the temporary file immediately, so that an invalid path fails before a long run.
  /// @throws FileError
  explicit AtomicFile(std::string path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// @throws FileError; all later calls also throw, because part of the content may be missing
  void write(std::string_view bytes);
  /// Ends writing, so that finish() has only to rename. No call of write() may follow.
  /// @throws FileError, for example if the disk is full
  void close();
  /// Completes the file. No call of write() may follow. @throws FileError
  void finish();

 private:
  void require_open() const;
  [[noreturn]] void fail(int error_number);

  std::string path_;
  std::filesystem::path target_;  ///< path_ with symbolic links resolved
  /// Path of the temporary file; target_ if that is not a regular file.
  std::filesystem::path part_;
  std::FILE* file_;
  bool closed_ = false, finished_ = false, failed_ = false;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
