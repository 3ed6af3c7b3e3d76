/// Runs a command and captures its output.
#pragma once

#include <jfpx/config.hpp>

#include <cstdio>
#include <stdexcept>
#include <string>

#if defined(_WIN32)
#define popen _popen
#define pclose _pclose
#else
#include <sys/wait.h>
#endif

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// Exit status and output of a process.
struct ProcessResult {
  int status = -1;     ///< exit status; 128 + signal if it was killed
  std::string output;  ///< stdout, and stderr if the command line redirects it
};

/// Redirects stderr to nothing, in a command line.
#if defined(_WIN32)
inline constexpr const char* kWithoutErrors = " 2>NUL";
#else
inline constexpr const char* kWithoutErrors = " 2>/dev/null";
#endif

/// Runs a command line of the system's shell.
inline ProcessResult run_process(std::string command) {
#if defined(_WIN32)
  command = "\"" + command + "\"";  // cmd.exe removes the outer quotation marks
#endif
  std::FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) throw std::runtime_error("can't start: " + command);
  ProcessResult result;
  char buffer[4096];
  for (std::size_t n; (n = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;) {
    result.output.append(buffer, n);
  }
  const int status = pclose(pipe);
#if defined(_WIN32)
  result.status = status;
#else
  result.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
#endif
  return result;
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
