/// Numbered pictures in a folder.
#include "src/viewer/recorder.hpp"

#include <jfpx/error.hpp>

#include <fmt/format.h>

#include <filesystem>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

Recorder::Recorder(std::string folder) : folder_(std::move(folder)) {
  if (folder_.empty()) return;
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error) throw FileError(folder_ + ": " + error.message());
}

void Recorder::add(const Image& image) {
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
