/// Software prefetch of cache lines. The functions are always inlined, so that sources for other
/// instruction sets may use them.
#pragma once

#include <jfpx/config.hpp>

namespace jfpx {
inline namespace JFPX_ABI {

/// Prefetches the cache line of `address` into the L2 cache. The address may be invalid. The L1
/// cache is not used, because its few line-fill buffers are exhausted by lines from memory, and the
/// next request would stall.
///
/// Uses inline assembly instead of __builtin_prefetch: GCC treats a function that contains only
/// __builtin_prefetch as free of side effects and silently removes calls that were not inlined.
[[gnu::always_inline]] inline void prefetch(const void* address) {
#if defined(__x86_64__)
  asm volatile("prefetcht1 (%0)" : : "r"(address));
#else
  asm volatile("prfm pldl2keep, [%0]" : : "r"(address));
#endif
}

/// Prefetches the cache line of `address` for writing and removes it from the caches of other
/// cores, so that a later store need not wait for the line. The address may be invalid. Processors
/// with AVX2 have the instruction, or ignore it.
[[gnu::always_inline]] inline void prefetch_for_write(const void* address) {
#if defined(__x86_64__)
  asm volatile("prefetchw (%0)" : : "r"(address));
#else
  asm volatile("prfm pstl1keep, [%0]" : : "r"(address));
#endif
}

}  // namespace JFPX_ABI
}  // namespace jfpx
