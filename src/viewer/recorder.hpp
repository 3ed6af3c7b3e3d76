/// Numbered pictures in a folder, to be made into a film.
#pragma once

#include "src/viewer/image.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

class Recorder {
 public:
  /// Makes the folder; an empty name records nothing. @throws FileError
  explicit Recorder(std::string folder);
  bool on() const { return !folder_.empty(); }
  const std::string& folder() const { return folder_; }
  /// Writes frame-000001.png and so on. @throws FileError
  void add(const Image& image);

 private:
  std::string folder_;
  unsigned frames_ = 0;
};

/// The first of STEM-1, STEM-2, ... that does not exist yet, with the ending.
std::string free_name(const std::string& stem, const std::string& ending);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
