/// Traversal of a tree of boxes along a ray, around a box, and by the distance from a box.
#pragma once

#include "src/collide/block_tree.hpp"
#include "src/collide/bounding_sphere.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

/// The tests are conservative. Let u be half of kEpsilon, and D the largest coordinate difference
/// between the query and the corners of a node.
///   - Rays: a point at the distance t from the origin is found if it is inside the bounds with an
///     error of at most 300 u D. The slab test adds less than 16 u D, by its own rounding and by
///     the lower limit of the direction. The margin is 512 u D.
///   - Solids that move along a line: the same with the bounds enlarged by the half extents of the
///     solid. D is then the largest coordinate difference to the enlarged bounds, and the margin
///     1024 u D, because the axes of both solids are rounded.
///   - Distances: the computed distance of two solids is at least that of their bounds, with an
///     error of at most 300 u (D + R), where R is the largest half extent of the query. The margin
///     is 1024 u (D + R).
///   - Boxes: the margin is at least 22 sqrt(epsilon) (D + R), where R is the largest half extent
///     of the query.
///   - kLostLength exceeds all lengths that are lost because their squares are denormal.
/// D of a node, and therefore its margin, is at least that of its children.
class TreeTraversal {
 public:
  /// [-], of distances, relative to D + R
  static constexpr Real kGapMargin = 512 * kEpsilon;
  /// [-], of boxes, relative to D + R
  static constexpr Real kOverlapMargin = sizeof(Real) == 4 ? Real(0x1p-7) : Real(0x1p-21);

  /// Calls limit = visit(item) for each item that a ray may hit at a distance of at most the
  /// current limit [m].
  /// @param direction unit
  /// @param limit     [m], initial limit; may be infinite
  template <class Visit>
  static void visit_along(const BlockTreeView& tree, const Vec3& origin, const Vec3& direction,
                          Real limit, const Visit& visit) {
    traverse(tree, SlabTest<false>(origin, direction, {}), limit, visit);
  }

  /// Calls limit = visit(item) for each item that a solid may touch after a distance of at most the
  /// current limit [m], if its centre moves as above.
  /// @param half_extents [m], of the bounds of the solid
  template <class Visit>
  static void visit_swept(const BlockTreeView& tree, const Vec3& centre, const Vec3& half_extents,
                          const Vec3& direction, Real limit, const Visit& visit) {
    traverse(tree, SlabTest<true>(centre, direction, half_extents), limit, visit);
  }

  /// Calls limit = visit(item) for each item whose distance from a solid with the given bounds may
  /// be at most the current limit [m], roughly the nearest ones first.
  /// @param limit [m], >= 0, initial limit; may be infinite
  template <class Visit>
  static void visit_nearby(const BlockTreeView& tree, const Vec3& centre, const Vec3& half_extents,
                           Real limit, const Visit& visit) {
    traverse(tree, GapTest{centre, half_extents}, limit, visit);
  }

  /// Calls visit(item) for each item that a solid with the given bounds may touch.
  template <class Visit>
  static void visit_around(const BlockTreeView& tree, const Vec3& centre, const Vec3& half_extents,
                           const Visit& visit) {
    traverse(tree, OverlapTest{centre, half_extents}, 0, [&visit](std::uint32_t item) {
      visit(item);
      return Real(0);
    });
  }

 private:
  static constexpr std::uint32_t kWidth = TreeBlock::kWidth;
  using Lanes = std::array<Real, kWidth>;

  /// Distance at which a ray enters each lane, or at which a moving box does. The margin makes the
  /// test conservative; see above.
  template <bool kIsBox>
  struct SlabTest {
    SlabTest(const Vec3& from, const Vec3& direction, const Vec3& half)
        : origin(from), reach(half) {
      for (int i = 0; i < 3; ++i) {
        // The lower limit keeps the reciprocal, and all products with it, finite. It moves the
        // points of a ray in a node by less than 2 D epsilon^2.
        const Real size = std::max(absolute(direction[i]), kEpsilon * kEpsilon);
        descends[i] = direction[i] < 0;
        inverse[i] = Real(1) / (descends[i] ? -size : size);
      }
    }

    /// @return a lane is hit if entry <= exit
    void operator()(const TreeBlock& block, Real limit, Lanes& entry, Lanes& exit) const {
      constexpr Real kMargin = (kIsBox ? 512 : 256) * kEpsilon;
      Lanes near[3], far[3], size{};
      for (int i = 0; i < 3; ++i) {
        const Real* const first = descends[i] ? block.upper[i] : block.lower[i];
        const Real* const last = descends[i] ? block.lower[i] : block.upper[i];
        for (std::uint32_t lane = 0; lane < kWidth; ++lane) {
          near[i][lane] = first[lane] - origin[i];
          far[i][lane] = last[lane] - origin[i];
          if constexpr (kIsBox) {
            near[i][lane] += descends[i] ? reach[i] : -reach[i];
            far[i][lane] += descends[i] ? -reach[i] : reach[i];
          }
          const Real a = absolute(near[i][lane]), b = absolute(far[i][lane]);
          const Real larger = a > b ? a : b;
          size[lane] = larger > size[lane] ? larger : size[lane];
        }
      }
      entry.fill(0);
      exit.fill(limit);
      for (int i = 0; i < 3; ++i) {
        const Real k = inverse[i], steepness = absolute(k);
        for (std::uint32_t lane = 0; lane < kWidth; ++lane) {
          const Real margin = (size[lane] * kMargin + detail::kLostLength) * steepness;
          const Real enters = near[i][lane] * k - margin, leaves = far[i][lane] * k + margin;
          entry[lane] = enters > entry[lane] ? enters : entry[lane];
          exit[lane] = leaves < exit[lane] ? leaves : exit[lane];
        }
      }
    }

    Vec3 origin, reach, inverse;
    bool descends[3] = {};
  };

  /// Overlap of a box with each lane, with the margin of the comment above.
  struct OverlapTest {
    void operator()(const TreeBlock& block, Real, Lanes& entry, Lanes& exit) const {
      const Real reach = std::max({half_extents.x, half_extents.y, half_extents.z});
      Lanes size, gap;
      size.fill(reach);
      gap.fill(-reach);
      for (int i = 0; i < 3; ++i) {
        for (std::uint32_t lane = 0; lane < kWidth; ++lane) {
          const Real a = block.lower[i][lane] - centre[i], b = centre[i] - block.upper[i][lane];
          const Real nearer = (a > b ? a : b) - half_extents[i];
          gap[lane] = nearer > gap[lane] ? nearer : gap[lane];
          const Real c = absolute(a), d = absolute(b), larger = c > d ? c : d;
          size[lane] = larger + reach > size[lane] ? larger + reach : size[lane];
        }
      }
      exit.fill(0);
      for (std::uint32_t lane = 0; lane < kWidth; ++lane) {
        entry[lane] = gap[lane] - (size[lane] * kOverlapMargin + detail::kLostLength);
      }
    }

    Vec3 centre, half_extents;
  };

  /// Distance of a box from each lane, less the margin of the comment above.
  struct GapTest {
    void operator()(const TreeBlock& block, Real limit, Lanes& entry, Lanes& exit) const {
      const Real reach = std::max({half_extents.x, half_extents.y, half_extents.z});
      Lanes size, squared{};
      size.fill(reach);
      for (int i = 0; i < 3; ++i) {
        for (std::uint32_t lane = 0; lane < kWidth; ++lane) {
          const Real a = block.lower[i][lane] - centre[i], b = centre[i] - block.upper[i][lane];
          const Real beside = (a > b ? a : b) - half_extents[i];
          const Real gap = beside > 0 ? beside : Real(0);
          squared[lane] += gap * gap;
          const Real c = absolute(a), d = absolute(b), larger = c > d ? c : d;
          size[lane] = larger + reach > size[lane] ? larger + reach : size[lane];
        }
      }
      // Unused lanes are farther than any solid.
      exit.fill(std::min(limit, TreeBlock::kFar / 4));
      for (std::uint32_t lane = 0; lane < kWidth; ++lane) {
        entry[lane] = square_root(squared[lane]) - (size[lane] * kGapMargin + detail::kLostLength);
      }
    }

    Vec3 centre, half_extents;
  };

  /// Depth first, nearest block first.
  template <class Test, class Visit>
  static void traverse(const BlockTreeView& tree, const Test& test, Real limit,
                       const Visit& visit) {
    if (tree.block_count == 0) return;
    struct Entry {
      Real distance;
      std::uint32_t block;
    };
    std::array<Entry, BlockTreeView::kMostWaiting> stack;
    std::size_t count = 0;
    stack[count++] = {0, tree.block_count - 1};
    Lanes entry, exit;
    while (count > 0) {
      const Entry next = stack[--count];
      if (next.distance > limit) continue;
      test(tree.blocks[next.block], limit, entry, exit);
      if (next.block < tree.leaf_blocks) {
        for (std::uint32_t lane = 0; lane < kWidth; ++lane) {
          if (!(entry[lane] <= exit[lane]) || entry[lane] > limit) continue;
          limit = visit(tree.items[next.block * kWidth + lane]);
        }
        continue;
      }
      const std::size_t base = count;
      const std::uint32_t first_child = (next.block - tree.leaf_blocks) * kWidth;
      for (std::uint32_t lane = 0; lane < kWidth; ++lane) {
        if (!(entry[lane] <= exit[lane])) continue;
        std::size_t slot = count++;
        for (; slot > base && stack[slot - 1].distance < entry[lane]; --slot) {
          stack[slot] = stack[slot - 1];
        }
        stack[slot] = {entry[lane], first_child + lane};
      }
    }
  }
};

}  // namespace JFPX_ABI
}  // namespace jfpx
