/// Pictures in memory and as PNG files.
#include "examples/viewer/image.hpp"

#include <jfpx/error.hpp>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <png.h>
#include <system_error>

namespace jfpx::inline JFPX_ABI::view {
namespace {

png_image new_image() {
  png_image png;
  std::memset(&png, 0, sizeof png);
  png.version = PNG_IMAGE_VERSION;
  return png;
}

}  // namespace

void write_png(const Image& image, const std::string& path) {
  png_image png = new_image();
  png.width = static_cast<png_uint_32>(image.width);
  png.height = static_cast<png_uint_32>(image.height);
  png.format = PNG_FORMAT_RGB;
  const std::string part = path + ".part";
  const bool written =
      png_image_write_to_file(&png, part.c_str(), 0, image.rgb.data(), 0, nullptr) != 0;
  if (written && std::rename(part.c_str(), path.c_str()) == 0) return;
  const std::string why = written ? std::generic_category().message(errno) : png.message;
  std::remove(part.c_str());
  throw FileError(path + ": can't be written: " + why);
}

Image read_png(const std::string& path) {
  png_image png = new_image();
  if (png_image_begin_read_from_file(&png, path.c_str()) != 0) {
    png.format = PNG_FORMAT_RGB;
    Image image{static_cast<int>(png.width), static_cast<int>(png.height), {}};
    image.rgb.resize(PNG_IMAGE_SIZE(png));
    if (png_image_finish_read(&png, nullptr, image.rgb.data(), 0, nullptr) != 0) return image;
  }
  png_image_free(&png);
  throw FileError(path + ": " + png.message);
}

}  // namespace jfpx::inline JFPX_ABI::view
