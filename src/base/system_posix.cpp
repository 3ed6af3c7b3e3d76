/// Implementation of system.hpp for Linux, and for macOS.
#include "src/base/system.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <sys/mman.h>
#include <unistd.h>
#if defined(__APPLE__)
#include <mach-o/dyld.h>
#endif

namespace jfpx {
inline namespace JFPX_ABI {

namespace fs = std::filesystem;

namespace {

/// Empty if the variable is not set, or its value is not absolute.
fs::path folder_from_environment(const char* variable) {
  const char* const value = std::getenv(variable);
  if (value == nullptr || !fs::path(value).is_absolute()) return {};
  return value;
}

}  // namespace

const char* const kCacheFolderVariable = "HOME";

fs::path to_path(const std::string& text) { return text; }
std::string to_text(const fs::path& path) { return path.string(); }

std::FILE* open_file(const std::string& path, const char* mode) {
  return std::fopen(path.c_str(), mode);
}

fs::path cache_folder() {
  if (fs::path cache = folder_from_environment("XDG_CACHE_HOME"); !cache.empty()) return cache;
  const fs::path home = folder_from_environment("HOME");
  return home.empty() ? fs::path() : home / ".cache";
}

void advise_huge_pages([[maybe_unused]] void* memory, [[maybe_unused]] std::size_t bytes) noexcept {
#if defined(MADV_HUGEPAGE)
  ::madvise(memory, bytes, MADV_HUGEPAGE);  // a hint, so a failure is not an error
#endif
}

std::uint64_t physical_memory() noexcept {
  return static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES)) *
         static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

bool is_terminal(std::FILE* stream) noexcept { return ::isatty(::fileno(stream)) != 0; }

std::vector<std::string> start_program(int argc, char** argv) { return {argv + 1, argv + argc}; }

fs::path program_path() {
#if defined(__APPLE__)
  std::string path(1, '\0');
  std::uint32_t size = 1;
  if (::_NSGetExecutablePath(path.data(), &size) != 0) {
    path.resize(size);
    ::_NSGetExecutablePath(path.data(), &size);
  }
  return fs::canonical(path.c_str());
#else
  return fs::read_symlink("/proc/self/exe");
#endif
}

std::string run_instead(const fs::path& program, const std::vector<std::string>& arguments) {
  std::vector<std::string> texts = arguments;  // execv() takes pointers to variable texts
  texts.insert(texts.begin(), program.string());
  std::vector<char*> pointers;
  for (std::string& text : texts) pointers.push_back(text.data());
  pointers.push_back(nullptr);
  ::execv(program.c_str(), pointers.data());
  return std::strerror(errno);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
