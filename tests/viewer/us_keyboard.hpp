/// Scancodes of the keys of a US keyboard, also before SDL has initialized a video driver.
#pragma once

#include <jfpx/config.hpp>

#include <SDL.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

inline SDL_Scancode us_scancode(SDL_Keycode code) {
  if (code >= SDLK_a && code <= SDLK_z) {
    return static_cast<SDL_Scancode>(SDL_SCANCODE_A + (code - SDLK_a));
  }
  if ((code & SDLK_SCANCODE_MASK) != 0) {
    const int scancode = code & ~SDLK_SCANCODE_MASK;
    const bool valid = scancode >= 0 && scancode < SDL_NUM_SCANCODES;
    return valid ? static_cast<SDL_Scancode>(scancode) : SDL_SCANCODE_UNKNOWN;
  }
  return SDL_GetScancodeFromKey(code);
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
