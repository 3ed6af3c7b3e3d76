/// Classification of exceptions in Bullet's callbacks, through which none may propagate.
#pragma once

#include <jfpx/error.hpp>

#include <exception>
#include <new>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Whether an allocation failed, which may succeed again in the next step.
inline bool is_out_of_memory(const std::exception& error) noexcept {
  return dynamic_cast<const std::bad_alloc*>(&error) != nullptr ||
         dynamic_cast<const OutOfMemory*>(&error) != nullptr;
}

/// The message of the error, never empty, even if there is no memory for a copy.
inline std::string message_of(const std::exception& error) noexcept {
  try {
    const std::string text = error.what();
    return text.empty() ? "unknown" : text;
  } catch (const std::bad_alloc&) {
    return "out of memory";  // short enough to be stored without an allocation
  }
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
