/// Ctrl-C as an exception, so that a long run leaves no half files behind.
#pragma once

#include <jfpx/config.hpp>

#include <array>
#include <csignal>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

/// The user, or the system, wants the process to end.
struct Interrupted {
  int signal;
};

/// While one lives, SIGINT and SIGTERM wait for check(); a second one ends the process at once.
/// Signals that the process was started to ignore stay ignored. One at a time, in one thread.
class Interrupts {
 public:
  Interrupts();
  ~Interrupts();
  Interrupts(const Interrupts&) = delete;
  Interrupts& operator=(const Interrupts&) = delete;

  /// @throws Interrupted
  static void check();

 private:
  static constexpr std::array<int, 2> kSignals = {SIGINT, SIGTERM};
  std::array<struct sigaction, kSignals.size()> before_{};
};

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
