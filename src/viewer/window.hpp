/// A window with an OpenGL 3.3 context, or a context without a visible window.
#pragma once

#include <jfpx/config.hpp>

#include <SDL.h>

#include <memory>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Only one object may exist at a time, because SDL is global.
class Window {
 public:
  /// A visible, resizable window.
  /// @throws BackendUnavailable if there is no display or no OpenGL 3.3.
  static Window open(const std::string& title, int width, int height);
  /// A context without a visible window, which requires no display.
  /// @throws BackendUnavailable if there is no OpenGL 3.3.
  static Window hidden();

  /// True if the driver reports resets of the device.
  bool reports_resets() const;
  /// @throws BackendUnavailable if the device was reset, which invalidates all OpenGL objects.
  void check_context() const;
  /// Presents the picture. @throws as check_context()
  void swap();  // NOLINT(bugprone-exception-escape): buffers, not windows
  void set_title(const std::string& title);
  void set_fullscreen(bool on);
  bool fullscreen() const { return fullscreen_; }
  /// A captured mouse is hidden and reports unbounded relative motion.
  void capture_mouse(bool on);
  int width() const;   ///< [units], as mouse coordinates
  int height() const;  ///< [units]
  /// True if the window is invisible; its pixels may be undefined.
  bool minimised() const;
  int pixel_width() const;
  int pixel_height() const;
  /// Pixels per unit: 2 on many high-density screens.
  float pixel_ratio() const;
  SDL_Window* sdl() const { return window_.get(); }
  SDL_GLContext context() const { return context_.get(); }
  std::string driver() const;  ///< OpenGL's name of the renderer

 private:
  struct Quit {
    void operator()(int* started) const;
  };
  struct CloseWindow {
    void operator()(SDL_Window* window) const { SDL_DestroyWindow(window); }
  };
  struct CloseContext {
    void operator()(void* context) const { SDL_GL_DeleteContext(context); }
  };
  Window(const std::string& title, int width, int height, bool visible);

  static int started_;
  std::unique_ptr<int, Quit> library_;
  std::unique_ptr<SDL_Window, CloseWindow> window_;
  std::unique_ptr<void, CloseContext> context_;
  bool fullscreen_ = false;
  bool synchronised_ = false;  ///< swap() waits for the screen
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
