/// Runs the pair tests on host and device.
#pragma once

#include <jfpx/config.hpp>

#include <cstdint>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

struct PairTestRun {
  std::string failure;  ///< name of the first CUDA error; empty if there was none
  int differences = 0;  ///< inputs for which the results of host and device differ in any bit
  int touching_boxes = 0;
};
PairTestRun run_pair_tests(std::uint64_t seed, int count);

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
