/// Implementation of Interrupt.
#include "src/base/interrupt.hpp"

#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

#if defined(__linux__)
// In a library that is loaded later, the default model takes a call that may allocate, with the
// stack of malloc().
[[gnu::tls_model("initial-exec")]]
#endif
thread_local constinit Interrupt* current_interrupt = nullptr;

}  // namespace

Interrupt::Interrupt(void (*check)(), Clock::duration interval)
    : check_(check), interval_(interval), outer_(std::exchange(current_interrupt, this)) {}

Interrupt::~Interrupt() { current_interrupt = outer_; }

Interrupt* Interrupt::current() noexcept { return current_interrupt; }

void Interrupt::poll() {
  if (Clock::now() - last_ < interval_) return;
  check_();
  last_ = Clock::now();
}

}  // namespace JFPX_ABI
}  // namespace jfpx
