/// A framebuffer without a window.
#include "src/viewer/renderer.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

Canvas::Canvas(int width, int height)
    : width_(width),
      height_(height),
      colour_(make_texture(GL_RGBA8, width, height)),
      framebuffer_(make_framebuffer(colour_.name(), 0)) {}

Image Canvas::read_pixels(GLuint framebuffer, int width, int height) {
  Image image{width, height, {}};
  const auto row = static_cast<std::size_t>(width) * 3;
  image.rgb.resize(row * static_cast<std::size_t>(height));
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
  glReadBuffer(framebuffer == 0 ? GL_BACK : GL_COLOR_ATTACHMENT0);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, image.rgb.data());
  // OpenGL's rows start at the bottom.
  for (std::size_t y = 0; y < static_cast<std::size_t>(height) / 2; ++y) {
    std::uint8_t* upper = &image.rgb[y * row];
    std::swap_ranges(upper, upper + row,
                     &image.rgb[(static_cast<std::size_t>(height) - 1 - y) * row]);
  }
  return image;
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
