/// OpenGL 3.3 renderer: ray-cast spheres, boxes, meshes, grounds, soft shadows.
#pragma once

#include "src/viewer/camera.hpp"
#include "src/viewer/drawing.hpp"
#include "src/viewer/gl.hpp"
#include "src/viewer/image.hpp"

#include <memory>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Quality settings of a picture.
struct Quality {
  int supersample = 1;         ///< shaded samples per pixel along each axis
  int samples = 4;             ///< samples of multisample anti-aliasing
  int shadow_size = 2048;      ///< width of the shadow map [texels]; 0: no shadows
  int shadow_taps = 16;        ///< in each of the two loops of a soft shadow
  int occlusion_samples = 12;  ///< 0: no ambient occlusion
  friend bool operator==(const Quality&, const Quality&) = default;
};
inline constexpr Quality kLowQuality{1, 4, 1024, 4, 0};
inline constexpr Quality kMediumQuality{};
inline constexpr Quality kHighQuality{2, 4, 4096, 24, 24};

/// A rectangle of the output, in pixels from its lower left corner.
struct Viewport {
  int x = 0, y = 0, width = 0, height = 0;
  float unit = 1;  ///< unit of line widths [pixels]
};

/// Draws pictures. Requires a current context for its lifetime. A picture takes one draw call per
/// kind of item, or per mesh, and pass, independent of the number of bodies.
class Renderer {
 public:
  explicit Renderer(const Quality& quality = {});
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  void set_quality(const Quality& quality);
  const Quality& quality() const;

  /// Draws into the viewport of a framebuffer; 0 is the window.
  void draw(const Drawing& drawing, const View& view, const Viewport& viewport,
            GLuint framebuffer = 0);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A framebuffer without a window, for reading its pixels.
class OffscreenFramebuffer {
 public:
  OffscreenFramebuffer(int width, int height);
  int width() const { return width_; }
  int height() const { return height_; }
  GLuint framebuffer() const { return framebuffer_.name(); }
  Image read() const { return read_pixels(framebuffer(), width_, height_); }

  /// Reads the lower left part of a framebuffer.
  static Image read_pixels(GLuint framebuffer, int width, int height);

 private:
  int width_, height_;
  GlTexture colour_;
  GlFramebuffer framebuffer_;
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
