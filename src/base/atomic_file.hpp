/// A file that appears under its path only when it is complete.
#pragma once

#include <jfpx/config.hpp>

#include <cstdio>
#include <string>
#include <string_view>

namespace jfpx {
inline namespace JFPX_ABI {

/// Written beside its path and renamed at the end, so that the file is there whole or not at all.
/// What was not finished is removed. A link stays one: the file that it leads to is written. A
/// device or a pipe can't be replaced: what is written goes there at once.
class JFPX_API AtomicFile {
 public:
  /// Opens at once, so that a bad path fails before a long run. @throws FileError
  explicit AtomicFile(std::string path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// @throws FileError, and from then on always: a part of it may be missing
  void write(std::string_view bytes);
  /// Nothing may be written afterwards. @throws FileError
  void finish();

 private:
  void require_open() const;
  [[noreturn]] void fail();

  std::string path_;
  std::string target_;  ///< where the links of path_ end
  std::string part_;    ///< where it is written; target_ itself if that is no ordinary file
  std::FILE* file_;
  bool finished_ = false, failed_ = false;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
