/// Images in memory, as PNG files, and as numbered sequences of files.
#pragma once

#include <jfpx/config.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Rows from top to bottom, three bytes per pixel, sRGB.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;

  const std::uint8_t* at(int x, int y) const {
    return &rgb[(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                 static_cast<std::size_t>(x)) *
                3];
  }
};

/// Writes a PNG file atomically. @throws FileError
void write_png(const Image& image, const std::string& path);
/// Checks that write_png() can write the file, without creating it. @throws FileError like
/// write_png()
void require_writable(const std::string& path);
/// @throws FileError
Image read_png(const std::string& path);

/// Writes numbered images to a folder, for conversion to a film.
class ImageSequenceWriter {
 public:
  /// Creates the folder; an empty name disables the writer. @throws FileError
  explicit ImageSequenceWriter(std::string folder);
  bool on() const { return !folder_.empty(); }
  const std::string& folder() const { return folder_; }
  /// Writes frame-000001.png and so on. @throws FileError
  void add(const Image& image);

 private:
  std::string folder_;
  unsigned frames_ = 0;
};

/// The first name of STEM-1, STEM-2, ... with the ending that does not exist yet.
std::string free_name(const std::string& stem, const std::string& ending);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
