/// A bounding-volume tree of axis-aligned boxes in blocks of eight, for the CPU and for devices.
#pragma once

#include <jfpx/math.hpp>

#if !defined(__CUDACC__)
#include "src/base/real_lanes.hpp"
#endif

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Bounds of eight items or blocks. Unused lanes are empty: their lower bounds exceed the upper
/// bounds by more than any margin.
struct alignas(64) TreeBlock {
  static constexpr std::uint32_t kWidth = 8;
  Real lower[3][kWidth], upper[3][kWidth];  ///< [m], by axis

  /// [m], far outside of the world, where all coordinates of bodies are below 1e10. Differences,
  /// and their products with the reciprocal direction of a ray, remain finite.
  static constexpr Real kFar = Real(1e12);
  static constexpr Aabb kEmpty{{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};

  JFPX_HD void set(std::uint32_t lane, const Aabb& bounds) {
    for (int i = 0; i < 3; ++i) {
      lower[i][lane] = bounds.lower[i];
      upper[i][lane] = bounds.upper[i];
    }
  }
  /// The lanes whose bounds overlap a box, one bit each.
  JFPX_HD std::uint32_t overlapping_lanes(const Aabb& box) const {
    std::uint32_t lanes = 0;
#if defined(__CUDACC__)
    for (std::uint32_t lane = 0; lane < kWidth; ++lane) {
      bool is_gap = false;
      for (int i = 0; i < 3; ++i) {
        is_gap |= lower[i][lane] > box.upper[i];
        is_gap |= upper[i][lane] < box.lower[i];
      }
      lanes |= is_gap ? 0 : 1u << lane;
    }
#else
    for (std::uint32_t lane = 0; lane < kWidth; lane += cpu::kRealLanes) {
      const auto overlap = [&](int i) {
        return cpu::both(
            cpu::not_greater(cpu::load_lanes(lower[i] + lane), cpu::set_lanes(box.upper[i])),
            cpu::not_greater(cpu::set_lanes(box.lower[i]), cpu::load_lanes(upper[i] + lane)));
      };
      lanes |= cpu::bits(cpu::both(cpu::both(overlap(0), overlap(1)), overlap(2))) << lane;
    }
#endif
    return lanes;
  }
  /// Bounds of all lanes.
  JFPX_HD Aabb bounds() const {
    Aabb all;
    for (int i = 0; i < 3; ++i) {
      Real least = lower[i][0], most = upper[i][0];
      for (std::uint32_t lane = 1; lane < kWidth; ++lane) {
        least = lower[i][lane] < least ? lower[i][lane] : least;
        most = upper[i][lane] > most ? upper[i][lane] : most;
      }
      all.lower[i] = least;
      all.upper[i] = most;
    }
    return all;
  }
};

/// The arrays of a BlockTree, in host memory or on a device.
struct BlockTreeView {
  static constexpr std::uint32_t kWidth = TreeBlock::kWidth;
  /// 2^32 items have at most 12 levels; each visited block leaves seven siblings on the stack.
  static constexpr std::uint32_t kMostWaiting = 12 * kWidth;

  /// The leaf blocks, followed by their parents, level by level up to the root, which is last.
  /// Inner block i has the children 8 i to 8 i + 7.
  TreeBlock* blocks = nullptr;
  const std::uint32_t* items = nullptr;  ///< by leaf block and lane
  std::uint32_t leaf_blocks = 0, block_count = 0;
  std::uint32_t item_count = 0;

  /// Calls visit(item) for the items whose bounds overlap a box.
  template <class Visit>
  JFPX_HD void visit_overlapping(const Aabb& box, const Visit& visit) const {
    if (block_count == 0) return;
    std::uint32_t waiting[kMostWaiting];
    std::uint32_t count = 0;
    waiting[count++] = block_count - 1;
    while (count > 0) {
      const std::uint32_t index = waiting[--count];
      const TreeBlock& block = blocks[index];
      const std::uint32_t overlapping = block.overlapping_lanes(box);
      const bool is_leaf = index < leaf_blocks;
      const std::uint32_t first = (is_leaf ? index : index - leaf_blocks) * kWidth;
      for (std::uint32_t lane = 0; lane < kWidth; ++lane) {
        if ((overlapping >> lane & 1) == 0) continue;
        if (is_leaf) {
          visit(items[first + lane]);
        } else {
          waiting[count++] = first + lane;
        }
      }
    }
  }

  /// Recomputes the bounds of a leaf block. @param bounds_of function from an item to its bounds
  template <class BoundsOf>
  JFPX_HD void refit_leaf(std::uint32_t leaf, const BoundsOf& bounds_of) const {
    for (std::uint32_t lane = 0; lane < kWidth && leaf * kWidth + lane < item_count; ++lane) {
      blocks[leaf].set(lane, bounds_of(items[leaf * kWidth + lane]));
    }
  }
  /// Recomputes the bounds of an inner block from the bounds of its children.
  JFPX_HD void refit_inner(std::uint32_t block) const {
    const std::uint32_t first = (block - leaf_blocks) * kWidth;
    for (std::uint32_t lane = 0; lane < kWidth && first + lane < block; ++lane) {
      blocks[block].set(lane, blocks[first + lane].bounds());
    }
  }
  /// End of the inner blocks from `begin` on whose children precede `begin`.
  JFPX_HD std::uint32_t end_of_level(std::uint32_t begin) const {
    const std::uint32_t end = leaf_blocks + begin / kWidth;
    return end > begin ? end : begin + 1;
  }
};

/// Owns the blocks of a tree. The items are sorted along a Morton curve and packed into blocks
/// (Leutenegger, Lopez and Edgington 1997; Morton codes as in Lauterbach et al. 2009).
class BlockTree {
 public:
  /// Replaces the contents, in O(n) time. Memory is kept for the next call.
  /// @param bounds,items of the same size
  void build(std::span<const Aabb> bounds, std::span<const std::uint32_t> items);
  /// Recomputes all bounds and keeps the order of the items.
  template <class BoundsOf>
  void refit(const BoundsOf& bounds_of) {
    const BlockTreeView tree = view();
    for (std::uint32_t leaf = 0; leaf < leaf_blocks_; ++leaf) tree.refit_leaf(leaf, bounds_of);
    refit_inner();
  }
  /// Valid until the next build().
  BlockTreeView view() const {
    return {const_cast<TreeBlock*>(blocks_.data()), items_.data(), leaf_blocks_,
            static_cast<std::uint32_t>(blocks_.size()), item_count_};
  }

 private:
  struct Key {
    std::uint32_t code;   ///< size class and Morton code
    std::uint32_t index;  ///< of the item and its bounds
  };

  void sort(std::span<const Aabb> bounds);
  void refit_inner() {
    const BlockTreeView tree = view();
    for (std::uint32_t b = leaf_blocks_; b < tree.block_count; ++b) tree.refit_inner(b);
  }

  std::vector<TreeBlock> blocks_;
  std::vector<std::uint32_t> items_;
  std::uint32_t leaf_blocks_ = 0, item_count_ = 0;
  std::vector<Key> keys_, spare_keys_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
