/// A long run whose memory must stay flat.
#pragma once

#include <jfpx/config.hpp>

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <malloc.h>
#include <string>
#include <unistd.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// Steps of a soak; JFPX_SOAK_STEPS=1000000 asks for the long one.
inline std::uint64_t soak_steps() {
  const char* asked = std::getenv("JFPX_SOAK_STEPS");
  return asked != nullptr ? std::strtoull(asked, nullptr, 0) : 10'000;
}

/// What malloc has given out: [bytes]. Under sanitizers, which have their own, always 0.
inline std::size_t bytes_in_use() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

inline std::size_t resident_bytes() {
  std::ifstream file("/proc/self/statm");
  std::size_t size = 0, resident = 0;
  file >> size >> resident;
  return resident * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

/// Calls step(n) for n = 0, 1, ...; in the second half, memory does not grow beyond what buffers
/// may still need when a step sets a new record of contacts.
template <class Step>
void expect_flat_memory(std::uint64_t steps, Step step) {
  constexpr std::size_t kRecords = 128 * 1024, kPages = 4 * 1024 * 1024;
  std::uint64_t n = 0;
  while (n < steps / 2) step(n++);
  const std::size_t used = bytes_in_use(), resident = resident_bytes();
  while (n < steps) step(n++);
  const std::size_t used_at_end = bytes_in_use(), resident_at_end = resident_bytes();
  EXPECT_LE(used_at_end, used + kRecords);
  EXPECT_LE(resident_at_end, resident + kPages);
  testing::Test::RecordProperty("steps", std::to_string(steps));
  testing::Test::RecordProperty("bytes_in_use", std::to_string(used_at_end));
  testing::Test::RecordProperty("resident_bytes", std::to_string(resident_at_end));
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
