/// A file that appears under its path only when it is complete.
#include "src/atomic_file.hpp"

#include <jfpx/error.hpp>

#include "src/file.hpp"

#include <cerrno>
#include <filesystem>
#include <utility>

namespace jfpx::inline JFPX_ABI {

AtomicFile::AtomicFile(std::string path)
    : path_(std::move(path)),
      part_(std::filesystem::is_other(path_) ? path_ : path_ + ".part"),
      file_(std::fopen(part_.c_str(), "wb")) {
  if (file_ == nullptr) fail();
}

AtomicFile::~AtomicFile() {
  if (file_ != nullptr) std::fclose(file_);
  if (!finished_ && part_ != path_) std::remove(part_.c_str());
}

void AtomicFile::write(std::string_view bytes) {
  require_open();
  if (bytes.empty()) return;  // fwrite may not be given null
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) fail();
}

void AtomicFile::finish() {
  require_open();
  if (std::fclose(std::exchange(file_, nullptr)) != 0) fail();
  if (part_ != path_ && std::rename(part_.c_str(), path_.c_str()) != 0) fail();
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

}  // namespace jfpx::inline JFPX_ABI
