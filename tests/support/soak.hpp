/// Soak tests: long runs whose memory use must stay constant.
#pragma once

#include <jfpx/config.hpp>

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <string>

#if defined(_WIN32)
#include <windows.h>
// after windows.h
#include <psapi.h>
#undef near
#undef far
#else
#include <malloc.h>
#include <unistd.h>
#endif

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// Number of steps of a soak test: JFPX_SOAK_STEPS, by default 10,000.
inline std::uint64_t soak_steps() {
  const char* text = std::getenv("JFPX_SOAK_STEPS");
  return text != nullptr ? std::strtoull(text, nullptr, 0) : 10'000;
}

#if defined(_WIN32)
/// Not known on Windows.
inline std::size_t bytes_in_use() { return 0; }

/// [bytes], private memory of the process.
inline std::size_t resident_bytes() {
  PROCESS_MEMORY_COUNTERS_EX counters{};
  GetProcessMemoryInfo(GetCurrentProcess(), reinterpret_cast<PROCESS_MEMORY_COUNTERS*>(&counters),
                       sizeof counters);
  return counters.PrivateUsage;
}
#else
/// [bytes] allocated by malloc. Always 0 under sanitizers, which replace malloc.
inline std::size_t bytes_in_use() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

/// [bytes], resident set size of the process.
inline std::size_t resident_bytes() {
  std::ifstream file("/proc/self/statm");
  std::size_t size = 0, resident = 0;
  file >> size >> resident;
  return resident * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}
#endif

/// Calls step(n) for n = 0, 1, ..., `steps` - 1, and expects that memory use does not grow in the
/// second half, except for buffers that grow when a step has more contacts than all before.
/// @param worlds number of worlds, each with its own buffers
template <class Step>
void expect_flat_memory(std::uint64_t steps, Step step, std::size_t worlds = 1) {
  constexpr std::size_t kBuffers = 128 * 1024, kPages = 4 * 1024 * 1024;
  std::uint64_t n = 0;
  while (n < steps / 2) step(n++);
  const std::size_t used = bytes_in_use(), resident = resident_bytes();
  while (n < steps) step(n++);
  const std::size_t used_at_end = bytes_in_use(), resident_at_end = resident_bytes();
  EXPECT_LE(used_at_end, used + worlds * kBuffers);
  EXPECT_LE(resident_at_end, resident + kPages);
  testing::Test::RecordProperty("steps", std::to_string(steps));
  testing::Test::RecordProperty("bytes_in_use", std::to_string(used_at_end));
  testing::Test::RecordProperty("resident_bytes", std::to_string(resident_at_end));
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
