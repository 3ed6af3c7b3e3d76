/// Writes that fail. Not on Windows, which has no limit of the size of a file.
#pragma once

#include <jfpx/config.hpp>

#include <csignal>
#include <stdexcept>
#include <sys/resource.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// While it exists, no file of this process can grow beyond 10,000 bytes.
class FullDisk {
 public:
  FullDisk() {
    if (getrlimit(RLIMIT_FSIZE, &before_) != 0) throw std::runtime_error("getrlimit");
    const rlimit small{.rlim_cur = 10'000, .rlim_max = before_.rlim_max};
    if (setrlimit(RLIMIT_FSIZE, &small) != 0) throw std::runtime_error("setrlimit");
  }
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, old_handler_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
  void (*old_handler_)(int) = std::signal(SIGXFSZ, SIG_IGN);
};

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
