/// Reporting of findings, for all fuzz targets.
#pragma once

#include <jfpx/config.hpp>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string>

/// Entry point that each target defines: tests one input and returns 0.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace jfpx {
inline namespace JFPX_ABI {
namespace fuzz {

/// Reports a finding and aborts the program, so that the fuzzer keeps the input. Each line begins
/// with "ERROR:", because libFuzzer forwards only such lines from its child processes.
[[noreturn]] inline void report_finding(const std::string& what) {
  std::istringstream lines(what);
  for (std::string line; std::getline(lines, line);) {
    std::fprintf(stderr, "ERROR: finding: %s\n", line.c_str());
  }
  std::abort();
}

/// Reports a violated property. `property` is a sentence that must hold.
inline void require(bool holds, const char* property) {
  if (!holds) report_finding(std::string("violated: ") + property);
}

}  // namespace fuzz
}  // namespace JFPX_ABI
}  // namespace jfpx
