/// Distribution of the rows and bodies of a world of one block over the warps of a device.
#pragma once

#include "src/contact_solver/soft_step/row_kinds.hpp"
#include "src/world/device/step_data.hpp"

#include <bit>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Distributes rows or bodies over the warps of a dataflow: each warp has a power of two of them,
/// in its first lanes; the items of its other lanes are empty. All lanes of a warp wait until the
/// last one is ready, so a warp with fewer rows waits less.
class WarpItems {
 public:
  WarpItems() = default;
  static constexpr std::uint32_t kLanes = 32, kLog2OfLanes = 5;  ///< of a warp

  /// Chooses the least number per warp, within limits, for which each warp has one turn.
  /// @param n     number of rows or bodies
  /// @param warps number of warps
  /// @param least binary logarithm of the least number for each warp
  /// @param most  likewise, of the largest number, at most kLog2OfLanes
  JFPX_HD WarpItems(std::uint32_t n, std::uint32_t warps, std::uint32_t least, std::uint32_t most)
      : log2_per_warp_(least) {
    while (log2_per_warp_ < most && n > warps << log2_per_warp_) ++log2_per_warp_;
  }
  /// Number of items for n rows or bodies, a multiple of kLanes.
  JFPX_HD std::uint32_t items(std::uint32_t n) const {
    return (n + (1u << log2_per_warp_) - 1) >> log2_per_warp_ << kLog2OfLanes;
  }
  /// @returns the number of the row or body of an item; kNone if it is not less than n, or if the
  ///   lane is not in use
  JFPX_HD std::uint32_t find(std::uint32_t item, std::uint32_t n) const {
    const std::uint32_t lane = item % kLanes;
    const std::uint32_t number = (item >> kLog2OfLanes << log2_per_warp_) + lane;
    return lane >> log2_per_warp_ == 0 && number < n ? number : kNone;
  }

 private:
  std::uint32_t log2_per_warp_;
};

/// The rows of colors as items of a dataflow, in sweep order: by color, then by kind. The rows of a
/// warp have the same color and kind, so they are independent. The threads of a block share an
/// object.
class ColoredRows {
 public:
  /// A row, and the number of its color in the class.
  struct Found {
    std::uint32_t row, color;
  };

  /// Initializes the object. All threads of a block call it. Begins after a barrier of the block,
  /// and ends with one.
  /// @param bins  must outlive the object
  /// @param warps number of warps of the dataflow
  template <class Threads>
  JFPX_HD void start(const Threads& threads, const RowBins& bins, std::uint32_t warps) {
    threads.once([&] {
      begin_ = bins.begin;
      std::uint32_t others = 0;
      for (std::uint32_t kind = 0; kind < soft_step::kRowKinds; ++kind) {
        if (kind != kSpheres) others += count(kind);
      }
      spheres_ = {count(kSpheres) / kRowsPerThread, warps, kLog2LeastSpheres,
                  WarpItems::kLog2OfLanes};
      others_ = {others / kRowsPerThread, warps, 0, kLog2MostOthers};
    });
    threads.sync();
    threads.for_each(kBinsOfColors, [&](std::uint32_t i) {
      first_item_[i] = of_kind(kind(i)).items(size(bin(i)));
    });
    threads.sync();
    const std::uint32_t items = threads.scan(kBinsOfColors, first_item_);
    threads.once([&] { first_item_[kBinsOfColors] = items; });
    threads.sync();
  }
  /// Number of items.
  JFPX_HD std::uint32_t items() const { return first_item_[kBinsOfColors]; }
  /// @param item below items()
  /// @returns the row of an item; kNone if it has none
  JFPX_HD Found find(std::uint32_t item) const {
    // The last bin that does not begin after the item.
    std::uint32_t i = 0;
    for (std::uint32_t step = std::bit_floor(kBinsOfColors - 1); step > 0; step /= 2) {
      if (i + step < kBinsOfColors && first_item_[i + step] <= item) i += step;
    }
    const std::uint32_t number = of_kind(kind(i)).find(item - first_item_[i], size(bin(i)));
    return {number == kNone ? kNone : begin_[bin(i)] + number, i / soft_step::kRowKinds};
  }

 private:
  static constexpr std::uint32_t kFirstGroup = soft_step::group_of_crossing(0);
  static constexpr std::uint32_t kBinsOfColors =
      (soft_step::kFixedGroup - kFirstGroup) * soft_step::kRowKinds;
  static constexpr soft_step::RowKind kSpheres = soft_step::kKindOf<soft_step::SphereRow>;
  // Measured on an H200 (bench/results/world_cuda.md, boxes.md).
  /// Number of rows of a thread, one after the other, up to which warps have no more lanes in use.
  static constexpr std::uint32_t kRowsPerThread = 6;
  static constexpr std::uint32_t kLog2LeastSpheres = 3;
  /// Rows other than those of spheres have hundreds of bytes, and the lanes of a warp read them one
  /// after the other.
  static constexpr std::uint32_t kLog2MostOthers = 2;

  // Of a bin, by its number in sweep order.
  JFPX_HD static std::uint32_t kind(std::uint32_t i) { return i % soft_step::kRowKinds; }
  JFPX_HD static std::uint32_t bin(std::uint32_t i) {
    return soft_step::bin_of(kind(i), kFirstGroup + i / soft_step::kRowKinds);
  }

  /// Number of the rows of colors of a kind.
  JFPX_HD std::uint32_t count(std::uint32_t kind) const {
    return begin_[soft_step::bin_of(kind, soft_step::kFixedGroup)] -
           begin_[soft_step::bin_of(kind, kFirstGroup)];
  }
  JFPX_HD std::uint32_t size(std::uint32_t bin) const { return begin_[bin + 1] - begin_[bin]; }
  JFPX_HD const WarpItems& of_kind(std::uint32_t kind) const {
    return kind == kSpheres ? spheres_ : others_;
  }

  const std::uint32_t* begin_;
  WarpItems spheres_, others_;
  std::uint32_t first_item_[kBinsOfColors + 1];  ///< of each bin, and the end
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
