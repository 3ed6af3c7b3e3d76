/// Division of the pages of an array among several devices.
#pragma once

#include <jfpx/config.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// What the index of an array is, which decides which device has an item.
enum class ArrayIndex : std::uint8_t {
  slot,       ///< BodyId::index
  body,       ///< number of a living body
  sub_shape,  ///< number of a sub-shape
  place,      ///< solver index of a body
  block,      ///< number of a block of bodies
  contact,    ///< number of a contact
  manifold,   ///< number of a manifold
  pair,       ///< number of a pair of swept bounds
  equal,      ///< any other: each device has as many items
  of_first    ///< any other: the first device has the array
};

/// An array consists of columns, for example one for each member of its items. Each device has
/// consecutive items of each column.
struct PageLayout {
  ArrayIndex index = ArrayIndex::slot;
  std::size_t columns = 1;      ///< the array is divided into this number of equal parts
  std::size_t first_width = 1;  ///< of these, the first column has so many, all others have one
  std::size_t items = 0;        ///< number of items of a column; 0: of elements of the array

  /// By page of an array of `bytes` bytes, the part that has it: the one that has its middle.
  /// @param first by part: its first item, as a fraction of the items of a column, ascending from 0
  std::vector<std::uint32_t> parts_of_pages(std::size_t bytes, std::size_t page,
                                            const std::vector<double>& first) const {
    std::vector<std::uint32_t> parts;
    for (std::size_t begin = 0; begin < bytes; begin += page) {
      parts.push_back(part_of(std::min(begin + page / 2, bytes - 1), bytes, first));
    }
    return parts;
  }

 private:
  std::uint32_t part_of(std::size_t byte, std::size_t bytes,
                        const std::vector<double>& first) const {
    const double column = static_cast<double>(bytes) / static_cast<double>(columns);
    double at = static_cast<double>(byte), width = column * static_cast<double>(first_width);
    if (at >= width) {
      at -= width;
      width = column;
      at -= width * static_cast<double>(static_cast<std::size_t>(at / width));
    }
    std::uint32_t part = 0;
    while (part + 1 < first.size() && at / width >= first[part + 1]) ++part;
    return part;
  }
};

}  // namespace JFPX_ABI
}  // namespace jfpx
