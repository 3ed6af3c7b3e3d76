/// Values for the uninitialized variables of functions that are called afterwards.
#pragma once

#include <jfpx/config.hpp>

#include <cstring>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Overwrites the stack below the caller's frame, far enough for btConvexConvexAlgorithm, whose
/// frame has 1.3 KB in float and 2.2 KB in double.
[[gnu::noinline, gnu::no_sanitize_address]] inline void fill_stack(int byte) {
  char below[4096];
  std::memset(below, byte, sizeof below);
  asm volatile("" : : "r"(below) : "memory");  // keeps the call of memset
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
