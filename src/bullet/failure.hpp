/// What our own code can fail of inside Bullet, where no exception may pass.
#pragma once

#include <jfpx/error.hpp>

#include <exception>
#include <new>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Whether memory was wanting, which there may be again in the next step.
inline bool is_shortage(const std::exception& error) noexcept {
  return dynamic_cast<const std::bad_alloc*>(&error) != nullptr ||
         dynamic_cast<const OutOfMemory*>(&error) != nullptr;
}

/// What the error says, never nothing; also where there is no memory for it.
inline std::string text_of(const std::exception& error) noexcept {
  try {
    const std::string text = error.what();
    return text.empty() ? "unknown" : text;
  } catch (const std::bad_alloc&) {
    return "out of memory";  // short enough to need none
  }
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
