/// Text and panels over the picture: Dear ImGui in a window or an offscreen framebuffer.
#pragma once

#include "src/viewer/renderer.hpp"
#include "src/viewer/window.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Dear ImGui context. Only one object may exist at a time, in the thread of its OpenGL context.
class Ui {
 public:
  explicit Ui(Window& window);  ///< for a window, with its events
  explicit Ui(const OffscreenFramebuffer& offscreen);
  ~Ui();
  Ui(const Ui&) = delete;
  Ui& operator=(const Ui&) = delete;

  void handle(const SDL_Event& event);
  bool wants_keyboard() const;
  bool wants_mouse() const;
  void begin(double seconds);
  /// Draws all widgets since begin().
  void end(GLuint framebuffer, int width, int height);

 private:
  void set_up();
  void fit_text(float pixel_ratio);
  Window* window_ = nullptr;
  int width_ = 0, height_ = 0;  ///< [units]; of a window, when it was last visible
  float pixel_ratio_ = 0;       ///< of the current font
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
