/// Implementation of Interrupt.
#include "src/base/interrupt.hpp"

#include <atomic>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

thread_local constinit Interrupt* current_interrupt = nullptr;

// Of all threads. In a library that is loaded later, a thread's first read of a thread-local
// variable may allocate, with the stack of malloc(); programs without an interrupt never read one.
constinit std::atomic<int> interrupts{0};

}  // namespace

Interrupt::Interrupt(void (*check)(), Clock::duration interval)
    : check_(check), interval_(interval), outer_(std::exchange(current_interrupt, this)) {
  interrupts.fetch_add(1, std::memory_order_relaxed);
}

Interrupt::~Interrupt() {
  interrupts.fetch_sub(1, std::memory_order_relaxed);
  current_interrupt = outer_;
}

Interrupt* Interrupt::current() noexcept {
  if (interrupts.load(std::memory_order_relaxed) == 0) return nullptr;
  return current_interrupt;
}

void Interrupt::poll() {
  if (Clock::now() - last_ < interval_) return;
  check_();
  last_ = Clock::now();
}

}  // namespace JFPX_ABI
}  // namespace jfpx
