/// Pause instruction for polling loops.
#pragma once

#include <jfpx/config.hpp>

#if defined(__x86_64__)
#include <emmintrin.h>
#endif

namespace jfpx {
inline namespace JFPX_ABI {

/// Yields the core to its other hardware threads for some cycles. On most ARM64 cores, `yield` has
/// no effect; `isb` flushes the pipeline, which takes about as long as x86-64's `pause`.
inline void pause() {
#if defined(__x86_64__)
  _mm_pause();
#else
  asm volatile("isb" : : : "memory");
#endif
}

}  // namespace JFPX_ABI
}  // namespace jfpx
