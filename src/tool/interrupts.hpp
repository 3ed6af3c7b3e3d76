/// Conversion of SIGHUP, SIGINT and SIGTERM to an exception, so that a run leaves no partial files.
#pragma once

#include <jfpx/communicator.hpp>

#include <array>
#include <csignal>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

/// Thrown when a signal requests the end of the process.
struct Interrupted {
  int signal;
};

/// During its lifetime, defers SIGHUP, SIGINT and SIGTERM to the next call of check(); a second
/// signal ends the process immediately. Signals that were ignored at the start of the process
/// remain ignored. On Windows, Ctrl-C and Ctrl-Break take the place of SIGINT
/// and SIGHUP. Only one object may exist
/// at a time, in one thread.
class Interrupts {
 public:
  Interrupts();
  ~Interrupts();
  Interrupts(const Interrupts&) = delete;
  Interrupts& operator=(const Interrupts&) = delete;

  /// Whether a signal has arrived.
  static bool requested();
  /// @param ranks those that run together, of which each calls this; null: this process alone. A
  ///   signal that has arrived at any of them interrupts all.
  /// @throws Interrupted
  static void check(Communicator* ranks = nullptr);

 private:
#if defined(_WIN32)
  static constexpr std::array<int, 3> kSignals = {SIGINT, SIGBREAK, SIGTERM};
  std::array<void (*)(int), kSignals.size()> before_{};
#else
  static constexpr std::array<int, 3> kSignals = {SIGHUP, SIGINT, SIGTERM};
  std::array<struct sigaction, kSignals.size()> before_{};
#endif
};

/// Ends the process as the signal itself would, so that the shell sees the reason.
[[noreturn]] void end_by_signal(int signal);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
