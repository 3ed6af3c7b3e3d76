/// Division of the pages of an array among several devices.
#pragma once

#include <jfpx/config.hpp>

#include <algorithm>
#include <cstddef>

namespace jfpx {
inline namespace JFPX_ABI {

/// An array consists of columns, for example one for each member of its items. Each device has
/// consecutive items of each column.
struct PageLayout {
  std::size_t columns = 1;      ///< the array is divided into this number of equal parts
  std::size_t first_width = 1;  ///< of these, the first column has so many, all others have one
  double used = 1;  ///< fraction of the items of a column that the devices share, from the first on
  bool is_shared = true;  ///< false: the first device has the array

  /// Layout of an array of `count` items of which the devices share `shared` items.
  static PageLayout of(std::size_t shared, std::size_t count) {
    return {.used =
                static_cast<double>(shared) / static_cast<double>(std::max<std::size_t>(count, 1))};
  }
  /// The part that has a byte of an array of `bytes` bytes.
  std::size_t part_of(std::size_t byte, std::size_t bytes, std::size_t parts) const {
    const double column = static_cast<double>(bytes) / static_cast<double>(columns);
    const double first = column * static_cast<double>(first_width);
    double at = static_cast<double>(byte), width = first;
    if (at >= first) {
      at -= first;
      width = column;
      at -= width * static_cast<double>(static_cast<std::size_t>(at / width));
    }
    const auto part =
        static_cast<std::size_t>(at / (width * std::max(used, 0.01)) * static_cast<double>(parts));
    return std::min(part, parts - 1);
  }
};

}  // namespace JFPX_ABI
}  // namespace jfpx
