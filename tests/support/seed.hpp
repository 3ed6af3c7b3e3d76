/// Seed of a random test, which is always reported: with each failure, and on stdout before a crash
/// or a timeout.
#pragma once

#include <jfpx/config.hpp>

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// A random seed, or the value of JFPX_TEST_SEED. Must exist until the end of the test.
class Seed {
 public:
  Seed() {
    std::printf("%s\n", text_.c_str());
    std::fflush(stdout);
  }
  operator unsigned() const { return value_; }  // NOLINT(google-explicit-constructor)

 private:
  static unsigned draw() {
    const char* given = std::getenv("JFPX_TEST_SEED");
    return given != nullptr ? static_cast<unsigned>(std::strtoul(given, nullptr, 10))
                            : std::random_device{}();
  }

  unsigned value_ = draw();
  std::string text_ = "JFPX_TEST_SEED=" + std::to_string(value_);
  ::testing::ScopedTrace trace_{__FILE__, __LINE__, text_};
};

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
