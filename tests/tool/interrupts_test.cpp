/// Signals that end the commands.
#include "src/tool/interrupts.hpp"

#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>

namespace jfpx {
namespace {

/// Ends the process with the signal that check() reports.
[[noreturn]] void raise_and_check(int signal) {
  const tool::Interrupts interrupts;
  std::raise(signal);
  try {
    tool::Interrupts::check();
  } catch (const tool::Interrupted& interrupted) {
    std::exit(interrupted.signal);
  }
  std::exit(0);
}

TEST(InterruptsDeathTest, CheckReportsTheSignal) {
  for (const int signal : {SIGINT, SIGTERM}) {
    EXPECT_EXIT(raise_and_check(signal), testing::ExitedWithCode(signal), "");
  }
}

TEST(InterruptsDeathTest, ASecondSignalEndsTheProcess) {
  const auto raise_twice = [] {
    const tool::Interrupts interrupts;
    std::raise(SIGINT);
    std::raise(SIGINT);
    std::exit(0);
  };
  const auto is_not_zero = [](int status) { return status != 0; };
  EXPECT_EXIT(raise_twice(), is_not_zero, "");
}

TEST(InterruptsDeathTest, EndBySignalIsNoSuccess) {
  EXPECT_EXIT(
      tool::end_by_signal(SIGINT), [](int status) { return status != 0; }, "");
}

}  // namespace
}  // namespace jfpx
