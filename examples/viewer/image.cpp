/// Pictures in memory and as PNG files.
#include "examples/viewer/image.hpp"

#include <jfpx/error.hpp>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <stb_image.h>
#include <stb_image_write.h>

namespace jfpx::inline JFPX_ABI::view {

void write_png(const Image& image, const std::string& path) {
  const std::string part = path + ".part";
  errno = 0;
  stbi_write_png_compression_level = 9;
  const int written =
      stbi_write_png(part.c_str(), image.width, image.height, 3, image.rgb.data(), image.width * 3);
  if (written == 0 || std::rename(part.c_str(), path.c_str()) != 0) {
    const std::string reason = errno != 0 ? std::strerror(errno) : "the file can't be written";
    std::remove(part.c_str());
    throw FileError(path + ": " + reason);
  }
}

Image read_png(const std::string& path) {
  Image image;
  int channels = 0;
  const std::unique_ptr<std::uint8_t, decltype(&stbi_image_free)> data(
      stbi_load(path.c_str(), &image.width, &image.height, &channels, 3), stbi_image_free);
  if (data == nullptr) throw FileError(path + ": " + stbi_failure_reason());
  image.rgb.assign(data.get(), data.get() + static_cast<std::size_t>(image.width) *
                                                static_cast<std::size_t>(image.height) * 3);
  return image;
}

}  // namespace jfpx::inline JFPX_ABI::view
