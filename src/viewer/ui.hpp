/// Text and panels over the picture: Dear ImGui on a window or on a canvas.
#pragma once

#include "src/viewer/renderer.hpp"
#include "src/viewer/window.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// One at a time, in the thread of its OpenGL context.
class Ui {
 public:
  explicit Ui(Window& window);  ///< takes events from the window
  explicit Ui(const Canvas& canvas);
  ~Ui();
  Ui(const Ui&) = delete;
  Ui& operator=(const Ui&) = delete;

  void handle(const SDL_Event& event);
  bool wants_keyboard() const;
  bool wants_mouse() const;
  void begin(double seconds);
  /// Draws all that was asked for since begin().
  void end(GLuint framebuffer, int width, int height);

 private:
  void set_up();
  void fit_text(float pixel_ratio);
  Window* window_ = nullptr;
  int width_ = 0, height_ = 0;  ///< [units] of the canvas, or of the window when it was last seen
  float pixel_ratio_ = 0;       ///< that the text was made for
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
