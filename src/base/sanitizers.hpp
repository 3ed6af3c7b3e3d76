/// Sanitizers of this build.
#pragma once

#include <jfpx/config.hpp>

namespace jfpx {
inline namespace JFPX_ABI {

// GCC defines a macro; clang 14 supports __has_feature.
#if defined(__has_feature)
#define JFPX_HAS_FEATURE(name) __has_feature(name)
#else
#define JFPX_HAS_FEATURE(name) 0
#endif

#if defined(__SANITIZE_ADDRESS__) || JFPX_HAS_FEATURE(address_sanitizer)
inline constexpr bool kAddressSanitizer = true;
#else
inline constexpr bool kAddressSanitizer = false;
#endif

#if defined(__SANITIZE_THREAD__) || JFPX_HAS_FEATURE(thread_sanitizer)
inline constexpr bool kThreadSanitizer = true;
#else
inline constexpr bool kThreadSanitizer = false;
#endif

#undef JFPX_HAS_FEATURE

}  // namespace JFPX_ABI
}  // namespace jfpx
