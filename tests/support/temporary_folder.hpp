/// Temporary folder of a test.
#pragma once

#include <jfpx/config.hpp>

#include "src/base/system.hpp"

#include <filesystem>
#include <random>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// Creates a folder, and removes it with its content in the destructor.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::random_device random;
    do {
      path_ = std::filesystem::temp_directory_path() / ("jfpx-test-" + std::to_string(random()));
    } while (!std::filesystem::create_directory(path_));
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::string file(const std::string& name) const {
    return to_text((path_ / to_path(name)).make_preferred());
  }
  std::size_t entries() const {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(path_),
                                                  std::filesystem::directory_iterator()));
  }

 private:
  std::filesystem::path path_;
};

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
