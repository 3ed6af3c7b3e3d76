/// Cell numbers of an unbounded grid, in which neighbouring cells have neighbouring numbers.
#pragma once

#include <jfpx/shape.hpp>

#include "src/base/buffer.hpp"
#include "src/base/thread_pool.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

/// A subset of the spheres, as indices into all spheres.
struct SphereSubset {
  std::span<const SphereInstance> spheres;
  const std::uint32_t* order;  ///< null: all spheres in their order
  std::size_t count;

  std::uint32_t id(std::size_t i) const {
    return order != nullptr ? order[i] : static_cast<std::uint32_t>(i);
  }
  const SphereInstance& operator[](std::size_t i) const { return spheres[id(i)]; }
};

/// Cells along one axis, 0 to count()-1.
///
/// Claim: spheres that touch are at most one cell apart. The width of a cell is distance*(1 +
/// 2^-9), where distance is the largest sum of two extended radii (kernels.inl) that can occur. If
/// two spheres touch, |x_a - x_b| <= distance up to a few epsilon, which is at most 1 - 2^-10 of a
/// cell. A position is computed in double with five roundings of a number up to 2^38, so its error
/// is at most 2^-12. Hence positions differ by less than 1, and cells by at most 1. Positions
/// further than 2^37 cells from the middle are clamped to that distance, which moves no two of them
/// apart.
class CellAxis {
 public:
  static constexpr std::int64_t kNowhere = -2;

  /// Fits the axis to targets between `low` and `high`, most of them around `middle`. `distance` is
  /// at most half the largest Real.
  void fit(Real low, Real middle, Real high, Real distance);
  /// Renumbers the cells so that a gap of any number of empty cells becomes one empty cell. For
  /// very wide worlds, in which the product of three counts would overflow.
  void skip_empty_cells(const SphereSubset& targets, int axis);
  /// Merges pairs of cells. Neighbours stay neighbours.
  void halve();

  std::int64_t count() const noexcept { return count_; }
  /// Returns -1 to count() if x is in the cell of a target or next to one, else kNowhere.
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

  double middle_ = 0;  ///< a quarter of the coordinate, so that differences do not overflow
  double cells_per_quarter_ = 0;
  double begin_ = 0;  ///< position of the cell before the first one
  double end_ = 0;    ///< number of cells before renumbering, plus 2
  std::int64_t count_ = 0;
  std::size_t occupied_ = 0;  ///< 0: cells are not renumbered
  int halvings_ = 0;
  Buffer<std::int64_t> straight_;  ///< occupied cells before renumbering, ascending
  Buffer<std::int64_t> number_;    ///< new number of each of them
};

/// Numbers the cells of three axes.
class CellGrid {
 public:
  /// @param distance the largest sum of the extended radii of a target and of a sphere that it is
  ///   tested against
  void fit(const SphereSubset& targets, Real distance, ThreadPool& pool);

  /// Returns the number of the cell of a point, or kNowhere if no target is near. The numbers of
  /// spheres that touch differ by dx + dy*row() + dz*slab() with dx, dy, dz in -1..1.
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
  /// Upper bound of all cell numbers.
  std::int64_t cells() const noexcept { return cells_; }

 private:
  /// Sets row_, slab_ and cells_; returns false if the product is too large.
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
