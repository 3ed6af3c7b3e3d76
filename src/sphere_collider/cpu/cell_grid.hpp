/// Numbers the cells of a grid without bounds, so that neighbours have neighbouring numbers.
#pragma once

#include <jfpx/shape.hpp>

#include "src/base/buffer.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

/// The spheres that a sweep is about, as indices into all spheres.
struct SphereSubset {
  std::span<const SphereInstance> spheres;
  const std::uint32_t* order;  ///< null: all spheres as they come
  std::size_t count;

  std::uint32_t id(std::size_t i) const {
    return order != nullptr ? order[i] : static_cast<std::uint32_t>(i);
  }
  const SphereInstance& operator[](std::size_t i) const { return spheres[id(i)]; }
};

/// Cells along one axis, 0 to count()-1.
///
/// Claim: spheres that touch are at most one cell apart. A cell is distance*(1 + 2^-9) wide, where
/// distance is the largest sum of two enlarged radii (kernels.inl) that can meet. If two spheres
/// touch, |x_a - x_b| <= distance but for a few epsilon: at most 1 - 2^-10 of a cell. A
/// position is computed in double, by five roundings of a number up to 2^38: off by 2^-12 at most.
/// So positions differ by less than 1, and cells by at most 1. Positions further than 2^37 cells
/// from the middle are moved there, which brings none apart.
class CellAxis {
 public:
  static constexpr std::int64_t kNowhere = -2;

  /// For targets from `low` to `high`, most of them around `middle`; `distance` <= half the largest
  /// Real.
  void fit(Real low, Real middle, Real high, Real distance);
  /// Renumbers: a gap of any number of empty cells becomes one empty cell. For worlds so wide that
  /// the product of three counts would overflow.
  void skip_empty_cells(const SphereSubset& targets, int axis);
  /// Merges cells by twos; neighbours stay neighbours.
  void halve();

  std::int64_t count() const noexcept { return count_; }
  /// -1 to count() where x is in a target's cell or next to one; kNowhere if it is far from all.
  std::int64_t cell(Real x) const noexcept {
    const std::int64_t straight = straight_cell(x);
    return occupied_ == 0 || straight == kNowhere ? straight : renumbered(straight);
  }

 private:
  double position(Real x) const noexcept {
    const double p = (static_cast<double>(x) * 0.25 - middle_) * cells_per_quarter_;
    return std::min(std::max(p, -kFarthest), kFarthest);
  }
  std::int64_t straight_cell(Real x) const noexcept {
    const double p = position(x) - begin_;
    return p >= 0 && p < end_ ? static_cast<std::int64_t>(p) - 1 : kNowhere;
  }
  std::int64_t renumbered(std::int64_t cell) const noexcept;

  static constexpr double kFarthest = 0x1p37;

  double middle_ = 0;  ///< a quarter of the coordinate, so that no difference overflows
  double cells_per_quarter_ = 0;
  double begin_ = 0;  ///< position of the cell before the first
  double end_ = 0;    ///< straight cells + 2
  std::int64_t count_ = 0;
  std::size_t occupied_ = 0;  ///< 0: cells are not renumbered
  int halvings_ = 0;
  Buffer<std::int64_t> straight_;  ///< occupied cells, ascending
  Buffer<std::int64_t> number_;    ///< what each of them is called
};

class CellGrid {
 public:
  /// @param distance the largest sum of two enlarged radii, of a target and of what may meet it
  void fit(const SphereSubset& targets, Real distance);

  /// Number of a cell; spheres that touch have numbers that differ by dx + dy*row() + dz*slab()
  /// with dx, dy, dz in -1..1. kNowhere: no target is near.
  std::int64_t cell(const Vec3& centre) const noexcept {
    const std::int64_t x = axes_[0].cell(centre.x);
    const std::int64_t y = axes_[1].cell(centre.y);
    const std::int64_t z = axes_[2].cell(centre.z);
    if (x == CellAxis::kNowhere || y == CellAxis::kNowhere || z == CellAxis::kNowhere) {
      return kNowhere;
    }
    return (x + 1) + (y + 1) * row_ + (z + 1) * slab_;
  }
  static constexpr std::int64_t kNowhere = -1;

  std::int64_t row() const noexcept { return row_; }
  std::int64_t slab() const noexcept { return slab_; }
  /// All cells' numbers are below.
  std::int64_t cells() const noexcept { return cells_; }

 private:
  /// Sets row_, slab_, cells_; false if the product is too large.
  bool multiply() noexcept;

  CellAxis& axis(int i) noexcept { return axes_[static_cast<std::size_t>(i)]; }

  std::array<CellAxis, 3> axes_;
  std::int64_t row_ = 0;
  std::int64_t slab_ = 0;
  std::int64_t cells_ = 0;
};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
