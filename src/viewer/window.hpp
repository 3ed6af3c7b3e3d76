/// A window with OpenGL 3.3, or only the context where no window shall be seen.
#pragma once

#include <jfpx/config.hpp>

#include <SDL.h>

#include <memory>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// One at a time, because SDL is one.
class Window {
 public:
  /// A visible window that can be resized.
  /// @throws BackendUnavailable if there is no display or no OpenGL 3.3.
  static Window open(const std::string& title, int width, int height);
  /// A context without a window, which needs no display.
  /// @throws BackendUnavailable if there is no OpenGL 3.3.
  static Window hidden();

  /// Whether the driver says when the device was reset.
  bool tells_of_resets() const;
  /// @throws BackendUnavailable if the device was reset and all that it knew is gone.
  void check_context() const;
  /// Shows what was drawn. @throws as check_context()
  void swap();  // NOLINT(bugprone-exception-escape): buffers, not windows
  void set_title(const std::string& title);
  void set_fullscreen(bool on);
  bool fullscreen() const { return fullscreen_; }
  /// While captured, the mouse is hidden and reports movement without end.
  void capture_mouse(bool on);
  int width() const;   ///< in units, those of mouse coordinates
  int height() const;  ///< likewise
  /// Nobody sees it: what is drawn into it may get lost.
  bool minimised() const;
  int pixel_width() const;
  int pixel_height() const;
  /// Pixels of a unit: 2 on many high-density screens.
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
  bool synchronised_ = false;  ///< pictures wait for the screen
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
