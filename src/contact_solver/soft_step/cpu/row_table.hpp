/// Positions of the rows of a step on the CPU.
#pragma once

#include "src/base/reserve.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// Divides the rows of one kind into cells, in this order: rows of blocks by part and color, other
/// rows by color and part, rows with fixed bodies by their part, the overflow.
///
/// Usage: start(), set_size() for all cells with rows, scan(). Calls of set_size() may be
/// concurrent.
class RowTable {
 public:
  struct Shape {
    std::size_t parts = 0;                              ///< of the contacts of movable bodies
    std::size_t inner_colors = 0, crossing_colors = 0;  ///< ends of the occurring colors
    std::size_t fixed_parts = 0;                        ///< of the contacts with fixed bodies
  };

  /// Sets the number of cells, without rows.
  void start(const Shape& shape) {
    shape_ = shape;
    assign_geometric(&begin_, overflow() + 2, 0);
  }
  std::size_t inner(std::size_t part, std::size_t color) const {
    return part * shape_.inner_colors + color;
  }
  std::size_t crossing(std::size_t part, std::size_t color) const {
    return shape_.parts * shape_.inner_colors + color * shape_.parts + part;
  }
  std::size_t fixed(std::size_t part) const {
    return shape_.parts * (shape_.inner_colors + shape_.crossing_colors) + part;
  }
  std::size_t overflow() const { return fixed(shape_.fixed_parts); }

  void set_size(std::size_t cell, std::uint32_t rows) { begin_[cell] = rows; }
  /// Computes the first rows of the cells from their sizes.
  void scan() {
    std::uint32_t sum = 0;
    for (std::uint32_t& begin : begin_) {
      const std::uint32_t count = begin;
      begin = sum;
      sum += count;
    }
  }
  std::uint32_t begin(std::size_t cell) const { return begin_[cell]; }
  std::uint32_t end(std::size_t cell) const { return begin_[cell + 1]; }
  /// Number of rows of all kinds of cells.
  std::uint32_t size() const { return begin_.empty() ? 0 : begin_.back(); }

 private:
  Shape shape_;
  std::vector<std::uint32_t> begin_;  ///< by cell, and the end
};

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
