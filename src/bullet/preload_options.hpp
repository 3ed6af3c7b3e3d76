/// What the environment tells the preloaded engines. Values that mean nothing are as good as none:
/// there is nobody to tell.
#pragma once

#include <jfpx/config.hpp>

#include <optional>
#include <string_view>

namespace jfpx::inline JFPX_ABI::bullet {

/// Empty if not set.
std::string_view preload_setting(const char* name);
std::optional<unsigned long long> preload_number(const char* name);
/// JFPX_PRELOAD_THREADS: 0 is one per core; 1 if not set.
unsigned preload_threads();

}  // namespace jfpx::inline JFPX_ABI::bullet
