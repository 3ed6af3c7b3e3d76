/// Implementation of file.hpp with the C library.
#include "src/base/file.hpp"

#include <jfpx/error.hpp>

#include "src/base/atomic_file.hpp"
#include "src/base/system.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

struct Close {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, Close>;

}  // namespace

std::string file_message(const std::string& path, std::string_view what, int error_number) {
  return path + ": " + std::string(what) + ": " + std::strerror(error_number);
}

std::string read_file(const std::string& path) {
  const File file(open_file(path, "rb"));
  if (!file) throw FileError(file_message(path, "can't be opened", errno));
  std::string content;
  constexpr std::size_t kSize = std::size_t{1} << 16;  // too large for the stacks of some programs
  const auto buffer = std::make_unique<char[]>(kSize);
  for (std::size_t n; (n = std::fread(buffer.get(), 1, kSize, file.get())) > 0;) {
    content.append(buffer.get(), n);
  }
  if (std::ferror(file.get()) != 0) throw FileError(file_message(path, "can't be read", errno));
  return content;
}

void write_file(const std::string& path, std::string_view content) {
  AtomicFile file(path);
  file.write(content);
  file.finish();
}

}  // namespace JFPX_ABI
}  // namespace jfpx
