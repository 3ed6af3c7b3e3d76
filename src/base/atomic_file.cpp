/// Implementation of AtomicFile.
#include "src/base/atomic_file.hpp"

#include <jfpx/error.hpp>

#include "src/base/file.hpp"
#include "src/base/system.hpp"

#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

namespace fs = std::filesystem;

/// The temporary file.
fs::path part_of(fs::path target) {
  if (!is_special(target)) target += ".part";
  return target;
}

}  // namespace

bool is_special(const fs::path& path) {
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  return fs::exists(status) && !fs::is_regular_file(status);
}

fs::path follow_links(fs::path path) {
  constexpr int kMaxLinks = 40;  // the limit of Linux; links may form a cycle
  std::error_code ignored;
  for (int i = 0; i < kMaxLinks && fs::is_symlink(path, ignored); ++i) {
    path = path.parent_path() / fs::read_symlink(path, ignored);
  }
  return path;
}

AtomicFile::AtomicFile(std::string path)
    : path_(std::move(path)),
      target_(is_special(to_path(path_)) ? to_path(path_) : follow_links(to_path(path_))),
      part_(part_of(target_)),
      file_(open_file(to_text(part_), "wb")) {
  if (file_ == nullptr) fail(errno);
}

// Allocates nothing, because an exception of an allocation may be the reason.
AtomicFile::~AtomicFile() {
  if (file_ != nullptr) std::fclose(file_);
  std::error_code ignored;
  if (!finished_ && part_ != target_) fs::remove(part_, ignored);
}

void AtomicFile::write(std::string_view bytes) {
  require_open();
  if (bytes.empty()) return;  // fwrite does not accept a null pointer
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) fail(errno);
}

void AtomicFile::close() {
  require_open();
  if (std::fclose(std::exchange(file_, nullptr)) != 0) fail(errno);
  closed_ = true;
}

void AtomicFile::finish() {
  if (!closed_) close();
  if (finished_ || failed_) require_open();
  std::error_code error;
  if (part_ != target_) fs::rename(part_, target_, error);
  if (error) fail(error.default_error_condition().value());
  finished_ = true;
}

void AtomicFile::require_open() const {
  if (file_ == nullptr || failed_) {
    throw FileError(path_ + (finished_ ? " is already finished" : ": an earlier write failed"));
  }
}

void AtomicFile::fail(int error_number) {
  failed_ = true;
  throw FileError(file_message(path_, "can't be written", error_number));
}

}  // namespace JFPX_ABI
}  // namespace jfpx
