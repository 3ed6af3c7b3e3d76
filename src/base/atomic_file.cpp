/// A file that appears under its path only when it is complete.
#include "src/base/atomic_file.hpp"

#include <jfpx/error.hpp>

#include "src/base/file.hpp"

#include <cerrno>
#include <filesystem>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

namespace fs = std::filesystem;

/// Something is there, and renaming a file over it would destroy it.
bool is_special(const std::string& path) {
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  return fs::exists(status) && !fs::is_regular_file(status);
}

/// Where the links end, also where nothing is there yet.
std::string follow_links(const std::string& path) {
  constexpr int kMaxLinks = 40;  // as Linux: links may go round in circles
  fs::path target = path;
  std::error_code ignored;
  for (int i = 0; i < kMaxLinks && fs::is_symlink(target, ignored); ++i) {
    target = target.parent_path() / fs::read_symlink(target, ignored);
  }
  return target.string();
}

}  // namespace

AtomicFile::AtomicFile(std::string path)
    : path_(std::move(path)),
      target_(is_special(path_) ? path_ : follow_links(path_)),
      part_(is_special(target_) ? target_ : target_ + ".part"),
      file_(std::fopen(part_.c_str(), "wb")) {
  if (file_ == nullptr) fail();
}

AtomicFile::~AtomicFile() {
  if (file_ != nullptr) std::fclose(file_);
  if (!finished_ && part_ != target_) std::remove(part_.c_str());
}

void AtomicFile::write(std::string_view bytes) {
  require_open();
  if (bytes.empty()) return;  // fwrite may not be given null
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) fail();
}

void AtomicFile::finish() {
  require_open();
  if (std::fclose(std::exchange(file_, nullptr)) != 0) fail();
  if (part_ != target_ && std::rename(part_.c_str(), target_.c_str()) != 0) fail();
  finished_ = true;
}

void AtomicFile::require_open() const {
  if (file_ == nullptr || failed_) {
    throw FileError(path_ + (finished_ ? " is finished" : " could not be written before"));
  }
}

void AtomicFile::fail() {
  failed_ = true;
  throw FileError(file_message(path_, "can't be written", errno));
}

}  // namespace JFPX_ABI
}  // namespace jfpx
