/// What all fuzz targets share: how a finding is reported.
#pragma once

#include <jfpx/config.hpp>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string>

/// Each target defines it: tries one input, and returns 0 whatever the input is.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace jfpx {
inline namespace JFPX_ABI {
namespace fuzz {

/// Ends the program, so that the fuzzer keeps the input. Of what its processes write, libFuzzer
/// passes on the lines with "ERROR:" alone.
[[noreturn]] inline void report_finding(const std::string& what) {
  std::istringstream lines(what);
  for (std::string line; std::getline(lines, line);) {
    std::fprintf(stderr, "ERROR: finding: %s\n", line.c_str());
  }
  std::abort();
}

inline void require(bool holds, const char* what) {
  if (!holds) report_finding(std::string("not so: ") + what);
}

}  // namespace fuzz
}  // namespace JFPX_ABI
}  // namespace jfpx
