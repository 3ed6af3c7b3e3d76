/// Positions of the rows of a step on the CPU.
#pragma once

#include "src/base/reserve.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// Divides the rows of one kind into cells, in this order: rows of blocks by part and color, other
/// rows by color and part, rows with fixed bodies by their part, the overflow.
///
/// The rows of the inner cells, of each crossing color, of each part with fixed bodies, and of the
/// overflow start at multiples of an alignment. The numbers of the gaps before them have no row.
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
  void start(const Shape& shape, std::uint32_t alignment = 1) {
    shape_ = shape;
    alignment_ = alignment;
    size_ = 0;
    assign_geometric(&begin_, overflow() + 1, 0);
    assign_geometric(&end_, overflow() + 1, 0);
    gaps_.clear();
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
    for (std::size_t cell = 0; cell < begin_.size(); ++cell) {
      if (is_aligned(cell)) sum = align(sum);
      const std::uint32_t count = begin_[cell];
      begin_[cell] = sum;
      end_[cell] = sum += count;
    }
    size_ = align(sum);
  }
  /// Calls f(number) for all numbers below size() without a row.
  template <class F>
  void for_gaps(const F& f) const {
    for (const Gap& gap : gaps_) {
      for (std::uint32_t number = gap.begin; number < gap.end; ++number) f(number);
    }
  }
  std::uint32_t begin(std::size_t cell) const { return begin_[cell]; }
  std::uint32_t end(std::size_t cell) const { return end_[cell]; }
  /// Number of slices of a part of a crossing color.
  static constexpr std::size_t kSlices = 4;
  /// First row of a slice of a crossing color, or the end. Unless it is the end, it is a multiple
  /// of the alignment: threads that divide a color here do not share aligned groups of rows.
  /// @param slice up to kSlices * shape.parts
  std::uint32_t crossing_boundary(std::size_t slice, std::size_t color) const {
    const std::uint32_t end = end_[crossing(shape_.parts - 1, color)];
    const std::size_t part = slice / kSlices;
    if (part == shape_.parts) return end;
    const std::size_t cell = crossing(part, color);
    const auto before =
        static_cast<std::uint32_t>((end_[cell] - begin_[cell]) * (slice % kSlices) / kSlices);
    return std::min(end, aligned(begin_[cell] + before));
  }
  /// Number of rows in all cells, and between them: a multiple of the alignment.
  std::uint32_t size() const { return size_; }

 private:
  struct Gap {
    std::uint32_t begin, end;
  };
  /// The next multiple of the alignment.
  std::uint32_t align(std::uint32_t row) {
    const std::uint32_t next = aligned(row);
    if (next > row) gaps_.push_back({row, next});
    return next;
  }
  bool is_aligned(std::size_t cell) const {
    const std::size_t first_crossing = shape_.parts * shape_.inner_colors;
    if (cell < first_crossing || cell >= fixed(0)) return true;
    return (cell - first_crossing) % shape_.parts == 0;
  }
  std::uint32_t aligned(std::uint32_t row) const {
    return (row + alignment_ - 1) / alignment_ * alignment_;
  }

  Shape shape_;
  std::uint32_t alignment_ = 1, size_ = 0;
  std::vector<std::uint32_t> begin_, end_;  ///< by cell
  std::vector<Gap> gaps_;
};

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
