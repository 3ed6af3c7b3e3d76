/// Implementation of system.hpp for Linux, and for macOS.
#include "src/base/system.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fstream>
#include <limits>
#include <sys/mman.h>
#include <thread>
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

constexpr unsigned kNoQuota = std::numeric_limits<unsigned>::max();

/// Reads up to `count` numbers of a file. @returns the number of them
int read_numbers(const std::string& path, long long* numbers, int count) {
  std::FILE* const file = std::fopen(path.c_str(), "r");
  if (file == nullptr) return 0;
  int found = 0;
  while (found < count && std::fscanf(file, "%lld", numbers + found) == 1) ++found;
  std::fclose(file);
  return found;
}

/// The cores of a time that is allowed in each period.
unsigned cores_of(long long quota, long long period) {
  if (quota <= 0 || period <= 0) return kNoQuota;
  const long long cores = quota / period + (quota % period != 0 ? 1 : 0);
  return cores < kNoQuota ? static_cast<unsigned>(cores) : kNoQuota;
}

/// The quota of a control group.
unsigned cores_of_group(const std::string& folder, bool is_version_1) {
  long long numbers[2] = {};
  if (!is_version_1) {  // "max PERIOD" without a quota
    if (read_numbers(folder + "/cpu.max", numbers, 2) < 2) return kNoQuota;
    return cores_of(numbers[0], numbers[1]);
  }
  if (read_numbers(folder + "/cpu.cfs_quota_us", numbers, 1) < 1) return kNoQuota;
  if (read_numbers(folder + "/cpu.cfs_period_us", numbers + 1, 1) < 1) return kNoQuota;
  return cores_of(numbers[0], numbers[1]);
}

/// The least quota of a group and of the groups that contain it. In a container, the path may be
/// that outside: the folders that exist are then those of the container.
/// @param line of /proc/self/cgroup: HIERARCHY:CONTROLLERS:PATH
unsigned cores_of_line(const std::string& root, const std::string& line) {
  const std::size_t first = line.find(':');
  const std::size_t second = first == line.npos ? first : line.find(':', first + 1);
  if (second == line.npos) return kNoQuota;
  const std::string controllers = ',' + line.substr(first + 1, second - first - 1) + ',';
  const bool is_version_1 = controllers != ",,";
  if (is_version_1 && controllers.find(",cpu,") == controllers.npos) return kNoQuota;
  const std::string base = root + (is_version_1 ? "/sys/fs/cgroup/cpu" : "/sys/fs/cgroup");
  unsigned least = kNoQuota;
  for (std::string path = line.substr(second + 1);; path.resize(path.rfind('/'))) {
    least = std::min(least, cores_of_group(base + path, is_version_1));
    if (path.find('/') == path.npos) return least;
  }
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

unsigned cores_of_quotas(const std::string& root) noexcept {
  unsigned least = kNoQuota;
  try {
    std::ifstream groups(root + "/proc/self/cgroup");
    for (std::string line; std::getline(groups, line);) {
      least = std::min(least, cores_of_line(root, line));
    }
  } catch (const std::exception&) {
    // Without memory, the quota remains unknown.
  }
  return least;
}

unsigned usable_cores() noexcept {
  static const unsigned of_quotas = cores_of_quotas("");
  return std::min(of_quotas, std::max(1u, std::thread::hardware_concurrency()));
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
