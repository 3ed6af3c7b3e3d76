/// Asking for memory in time.
#pragma once

#include <jfpx/config.hpp>

namespace jfpx {
inline namespace JFPX_ABI {

/// Brings the cache line into the second-level cache; any address will do. Not into the first,
/// whose few open requests are all taken when lines come from memory: the next one would wait.
///
/// Not __builtin_prefetch: GCC takes a function that does nothing else for one without effects, and
/// silently drops the calls to it that were not inlined.
inline void prefetch(const void* address) { asm volatile("prefetcht1 (%0)" : : "r"(address)); }

}  // namespace JFPX_ABI
}  // namespace jfpx
