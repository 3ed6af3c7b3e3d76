/// Order of bounding boxes for trees that pack consecutive boxes.
#pragma once

#include <jfpx/shape.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

/// Order by size class, then along a Morton curve. A large box among small ones would enlarge its
/// block, so boxes above a multiple of the median size have separate blocks. The curve fills a grid
/// of 1024^3 cells around the middle seven eighths of the boxes. All other boxes are in the
/// outermost cells, so that a box that has left the scene does not enlarge the cells.
class SpatialOrder {
 public:
  /// @param sample largest number of boxes, at most 256, that determine sizes and cells
  /// @param bounds_of function from the number of a box to its bounds, which may be infinite
  template <class BoundsOf>
  SpatialOrder(std::size_t count, std::size_t sample, const BoundsOf& bounds_of) {
    const std::size_t size = std::min(count, sample);
    std::array<Real, kMaxSample> values{};
    const auto sort_values = [&](const auto& quantity) {
      for (std::size_t i = 0; i < size; ++i) {
        const Real value = quantity(bounds_of(count * i / size));
        values[i] = value == value ? value : Real(0);  // the sum of opposite infinities is NaN
      }
      std::sort(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(size));
    };
    const auto quantile = [&](std::size_t sixteenths) {
      return size > 0 ? values[(size - 1) * sixteenths / 16] : Real(0);
    };
    sort_values(size_of);
    limit_ = Vec3{4, 16, 64} * quantile(8);
    for (int i = 0; i < 3; ++i) {
      sort_values([i](const Aabb& b) { return b.lower[i] + b.upper[i]; });
      const Real low = quantile(1), high = quantile(15);
      const Real margin = (high - low) / 4;
      begin_[i] = low - margin;
      scale_[i] = high > low ? 1024 / (high - low + 2 * margin) : Real(0);
    }
  }

  /// Position of a box in the order.
  std::uint32_t operator()(const Aabb& bounds) const {
    const Real size = size_of(bounds);
    std::uint32_t code = 0;
    for (int i = 0; i < 3; ++i) code += size > limit_[i] ? 1u << 30 : 0u;
    for (int i = 0; i < 3; ++i) {
      const Real cell = (bounds.lower[i] + bounds.upper[i] - begin_[i]) * scale_[i];
      // Also correct for infinity and NaN after an overflow.
      const Real inside = !(cell > 0) ? Real(0) : !(cell < 1023) ? Real(1023) : cell;
      code += spread(static_cast<std::uint32_t>(inside)) << i;
    }
    return code;
  }

 private:
  static constexpr std::size_t kMaxSample = 256;

  static Real size_of(const Aabb& bounds) {
    const Vec3 size = bounds.upper - bounds.lower;
    return std::max({size.x, size.y, size.z});
  }
  /// The lowest ten bits, spread to every third bit.
  static std::uint32_t spread(std::uint32_t bits) {
    bits = (bits | bits << 16) & 0x030000ffu;
    bits = (bits | bits << 8) & 0x0300f00fu;
    bits = (bits | bits << 4) & 0x030c30c3u;
    return (bits | bits << 2) & 0x09249249u;
  }

  Vec3 limit_;          ///< [m], of the size classes
  Vec3 begin_, scale_;  ///< of the sum of lower and upper bound
};

}  // namespace JFPX_ABI
}  // namespace jfpx
