/// Base of tests that open windows, without a display and in a temporary folder.
#pragma once

#include <jfpx/error.hpp>

#include "src/viewer/interactive.hpp"
#include "tests/support/environment.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/viewer/us_keyboard.hpp"

#include <SDL.h>
#include <gtest/gtest.h>

#include <filesystem>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// Base of tests that open windows. They are skipped with the reason if OpenGL is not available.
/// The temporary folder is the current folder.
class WindowTest : public ::testing::Test {
 protected:
  void SetUp() override {
    try {
      (void)view::Window::hidden();
    } catch (const BackendUnavailable& error) {
      GTEST_SKIP() << error.what();
    }
    std::filesystem::current_path(folder.file(""));
    start_events();
  }
  void TearDown() override { std::filesystem::current_path(before_); }

  /// Allows events to be pushed before a window exists.
  static void start_events() {
    SDL_SetMainReady();
    ASSERT_EQ(SDL_Init(SDL_INIT_EVENTS), 0) << SDL_GetError();
  }

  const TemporaryFolder folder;

 private:
  const EnvironmentVariable driver_{"SDL_VIDEODRIVER", "offscreen"};
  std::filesystem::path before_ = std::filesystem::current_path();
};

inline void push_key(SDL_Keycode code, bool down) {
  SDL_Event event{};
  event.type = down ? SDL_KEYDOWN : SDL_KEYUP;
  event.key.keysym.sym = code;
  event.key.keysym.scancode = us_scancode(code);
  SDL_PushEvent(&event);
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
