/// Pictures in memory and as PNG files.
#pragma once

#include <jfpx/config.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Rows from the top, three bytes a pixel, sRGB.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;

  const std::uint8_t* at(int x, int y) const {
    return &rgb[(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                 static_cast<std::size_t>(x)) *
                3];
  }
};

/// Writes a PNG, all or nothing. @throws FileError
void write_png(const Image& image, const std::string& path);
/// Leaves nothing behind. @throws FileError as write_png(), before there is a picture
void require_writable(const std::string& path);
/// @throws FileError
Image read_png(const std::string& path);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
