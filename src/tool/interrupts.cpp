/// Conversion of SIGHUP, SIGINT and SIGTERM to an exception.
#include "src/tool/interrupts.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {
namespace {

volatile std::sig_atomic_t g_signal = 0;

extern "C" void remember_signal(int signal) { g_signal = signal; }

}  // namespace

#if defined(_WIN32)

// The C run-time library resets a handler before it calls it.
Interrupts::Interrupts() {
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    before_[i] = std::signal(kSignals[i], remember_signal);
    if (before_[i] != SIG_DFL) std::signal(kSignals[i], before_[i]);
  }
}

Interrupts::~Interrupts() {
  for (std::size_t i = 0; i < kSignals.size(); ++i) std::signal(kSignals[i], before_[i]);
}

void end_by_signal(int) {
  constexpr unsigned kStatusControlCExit = 0xC000013A;  // STATUS_CONTROL_C_EXIT
  std::_Exit(static_cast<int>(kStatusControlCExit));
}

#else

Interrupts::Interrupts() {
  struct sigaction action {};
  action.sa_handler = remember_signal;
  action.sa_flags = SA_RESTART | static_cast<int>(SA_RESETHAND);
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    sigaction(kSignals[i], nullptr, &before_[i]);
    if (before_[i].sa_handler == SIG_DFL) sigaction(kSignals[i], &action, nullptr);
  }
}

Interrupts::~Interrupts() {
  for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &before_[i], nullptr);
}

void end_by_signal(int signal) {
  std::signal(signal, SIG_DFL);
  std::raise(signal);
  std::abort();
}

#endif

bool Interrupts::requested() { return g_signal != 0; }

void Interrupts::check(Communicator* ranks) {
  int signal = g_signal;
  if (ranks != nullptr) {
    std::vector<int> signals(ranks->size());
    ranks->gather(std::as_bytes(std::span(&signal, 1)), std::as_writable_bytes(std::span(signals)));
    signal = *std::ranges::max_element(signals);
  }
  if (signal != 0) throw Interrupted{signal};
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
