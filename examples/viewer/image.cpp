/// Pictures in memory and as PNG files.
#include "examples/viewer/image.hpp"

#include <jfpx/error.hpp>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
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

/// Where a picture is written before it has its name. What is no file, /dev/null for one, is not
/// replaced.
std::string part_of(const std::string& path) {
  return std::filesystem::is_other(path) ? path : path + ".part";
}

[[noreturn]] void fail(const std::string& path, const std::string& why) {
  throw FileError(path + ": can't be written: " + why);
}

}  // namespace

void require_writable(const std::string& path) {
  if (std::filesystem::is_directory(path)) fail(path, "it is a directory");
  const std::string part = part_of(path);
  std::FILE* file = std::fopen(part.c_str(), "wb");
  if (file == nullptr) fail(path, std::generic_category().message(errno));
  std::fclose(file);
  if (part != path) std::remove(part.c_str());
}

void write_png(const Image& image, const std::string& path) {
  png_image png = new_image();
  png.width = static_cast<png_uint_32>(image.width);
  png.height = static_cast<png_uint_32>(image.height);
  png.format = PNG_FORMAT_RGB;
  const std::string part = part_of(path);
  const bool written =
      png_image_write_to_file(&png, part.c_str(), 0, image.rgb.data(), 0, nullptr) != 0;
  if (written && part == path) return;
  if (written && std::rename(part.c_str(), path.c_str()) == 0) return;
  const std::string why = written ? std::generic_category().message(errno) : png.message;
  if (part != path) std::remove(part.c_str());
  fail(path, why);
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
