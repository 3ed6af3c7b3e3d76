/// Instruction for loops that poll.
#pragma once

#include <jfpx/config.hpp>

namespace jfpx {
inline namespace JFPX_ABI {

/// Leaves the core to its other hardware threads for some cycles. On ARM64, `yield` does nothing on
/// most cores; `isb` flushes the pipeline, which takes about as long as x86-64's `pause`.
inline void pause() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#else
  asm volatile("isb" : : : "memory");
#endif
}

}  // namespace JFPX_ABI
}  // namespace jfpx
