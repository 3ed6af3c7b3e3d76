/// Images in memory, as PNG files, and as numbered sequences of files.
#include "src/viewer/image.hpp"

#include <jfpx/error.hpp>

#include "src/base/atomic_file.hpp"

#include <fmt/format.h>

#include <cstring>
#include <filesystem>
#include <png.h>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

png_image new_image() {
  png_image png;
  std::memset(&png, 0, sizeof png);
  png.version = PNG_IMAGE_VERSION;
  return png;
}

}  // namespace

void require_writable(const std::string& path) { const AtomicFile unfinished(path); }

void write_png(const Image& image, const std::string& path) {
  png_image png = new_image();
  png.width = static_cast<png_uint_32>(image.width);
  png.height = static_cast<png_uint_32>(image.height);
  png.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(png);
  std::string bytes(size, '\0');
  if (png_image_write_to_memory(&png, bytes.data(), &size, 0, image.rgb.data(), 0, nullptr) == 0) {
    throw FileError(path + ": can't be written: " + png.message);
  }
  bytes.resize(size);
  AtomicFile file(path);
  file.write(bytes);
  file.finish();
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

ImageSequenceWriter::ImageSequenceWriter(std::string folder) : folder_(std::move(folder)) {
  if (folder_.empty()) return;
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error) throw FileError(folder_ + ": " + error.message());
}

void ImageSequenceWriter::add(const Image& image) {
  write_png(image, fmt::format("{}/frame-{:06}.png", folder_, ++frames_));
}

std::string free_name(const std::string& stem, const std::string& ending) {
  for (unsigned number = 1;; ++number) {
    std::string name = fmt::format("{}-{}{}", stem, number, ending);
    if (!std::filesystem::exists(name)) return name;
  }
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
