/// The seed of a random test, told in any case: in failures, and before a crash or a time limit.
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

/// A fresh seed, or the one in JFPX_TEST_SEED. Lives as long as the test that uses it.
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
