/// Fitting of a grid to spheres at any positions and distances.
#include "src/sphere_collider/cpu/cell_grid.hpp"

#include "src/base/parallel_for.hpp"

#include <algorithm>
#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

namespace {

constexpr std::size_t kTargetsPerChunk = 8192;

/// Returns the median of a sample of up to 64 targets, which is robust against outliers.
Real typical_coordinate(const SphereSubset& targets, int axis) {
  std::array<Real, 64> sample{};
  const std::size_t count = std::min(sample.size(), targets.count);
  for (std::size_t i = 0; i < count; ++i) {
    sample[i] = targets[i * targets.count / count].centre[axis];
  }
  const auto median = sample.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(sample.begin(), median, sample.begin() + static_cast<std::ptrdiff_t>(count));
  return *median;
}

}  // namespace

void CellAxis::fit(Real low, Real middle, Real high, Real distance) {
  constexpr double kMargin = 1 + 1.0 / 512;
  middle_ = static_cast<double>(middle) * 0.25;
  cells_per_quarter_ = 1 / (static_cast<double>(distance) * 0.25 * kMargin);
  begin_ = std::floor(position(low)) - 1;
  count_ = static_cast<std::int64_t>(position(high) - begin_);
  end_ = static_cast<double>(count_ + 2);
  occupied_ = 0;
  halvings_ = 0;
}

void CellAxis::skip_empty_cells(const SphereSubset& targets, int axis) {
  straight_.reserve(targets.count, "occupied cells");
  number_.reserve(targets.count, "numbers of cells");
  for (std::size_t i = 0; i < targets.count; ++i) {
    straight_[i] = straight_cell(targets[i].centre[axis]);
  }
  std::sort(straight_.data(), straight_.data() + targets.count);
  const std::int64_t* end = std::unique(straight_.data(), straight_.data() + targets.count);
  occupied_ = static_cast<std::size_t>(end - straight_.data());
  number_[0] = 0;
  for (std::size_t i = 1; i < occupied_; ++i) {
    number_[i] = number_[i - 1] + std::min<std::int64_t>(2, straight_[i] - straight_[i - 1]);
  }
  count_ = number_[occupied_ - 1] + 1;
}

void CellAxis::halve() {
  ++halvings_;
  count_ = (number_[occupied_ - 1] >> halvings_) + 1;
}

std::int64_t CellAxis::renumbered(std::int64_t cell) const noexcept {
  const std::int64_t* const begin = straight_.data();
  const std::int64_t* const end = begin + occupied_;
  const std::int64_t* near = std::lower_bound(begin, end, cell - 1);
  if (near != end && *near == cell - 1 && near + 1 != end && near[1] == cell) ++near;
  if (near == end || *near > cell + 1) return kNowhere;
  return (number_[static_cast<std::size_t>(near - begin)] + (cell - *near)) >> halvings_;
}

bool CellGrid::multiply() noexcept {
  double product = 1;
  for (const CellAxis& axis : axes_) product *= static_cast<double>(axis.count() + 2);
  if (product >= 0x1p62) return false;
  row_ = axes_[0].count() + 2;
  slab_ = row_ * (axes_[1].count() + 2);
  cells_ = slab_ * (axes_[2].count() + 2);
  return true;
}

void CellGrid::fit(const SphereSubset& targets, Real distance, ThreadPool& pool) {
  const auto box_of = [&](std::size_t first, std::size_t last) {
    Aabb box;
    for (std::size_t i = first; i < last; ++i) {
      const Vec3& p = targets[i].centre;
      box = merged(box, {p, p});
    }
    return box;
  };
  const Aabb box = parallel_reduce(&pool, targets.count, kTargetsPerChunk, Aabb(), box_of,
                                   [](const Aabb& a, const Aabb& b) { return merged(a, b); });
  for (int i = 0; i < 3; ++i) {
    axis(i).fit(box.lower[i], typical_coordinate(targets, i), box.upper[i], distance);
  }
  if (multiply()) return;
  for (int i = 0; i < 3; ++i) axis(i).skip_empty_cells(targets, i);
  while (!multiply()) {
    std::max_element(axes_.begin(), axes_.end(), [](const CellAxis& a, const CellAxis& b) {
      return a.count() < b.count();
    })->halve();
  }
}

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
