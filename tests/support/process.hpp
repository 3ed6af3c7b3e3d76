/// Runs a command and captures its output.
#pragma once

#include <jfpx/config.hpp>

#include <cstdio>
#include <stdexcept>
#include <string>
#include <sys/wait.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// Exit status and output of a process.
struct ProcessResult {
  int status = -1;     ///< exit status; 128 + signal if it was killed
  std::string output;  ///< stdout, and stderr if the command line redirects it
};

/// Runs a shell command line.
inline ProcessResult run_process(const std::string& command) {
  std::FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) throw std::runtime_error("can't start: " + command);
  ProcessResult result;
  char buffer[4096];
  for (std::size_t n; (n = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;) {
    result.output.append(buffer, n);
  }
  const int status = pclose(pipe);
  result.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return result;
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
