/// Pairs among very many spheres of any sizes: sorted cells, one grid for each class of radii.
#pragma once

#include "src/base/radix_sort.hpp"
#include "src/sphere_collider/cpu/cell_grid.hpp"
#include "src/sphere_collider/cpu/pair_chunks.hpp"
#include "src/sphere_collider/cpu/sphere_table.hpp"

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

/// A hierarchical grid (Krijgsman et al. 2014, doi 10.1007/s40571-014-0020-9) whose cells are never
/// stored. Spheres are put into classes of similar radii. For each class, from the largest radii to
/// the smallest, the spheres of the class (targets) are sorted by cell; they are tested against
/// each other and against all smaller spheres (queries), sorted by the same cells. A query's
/// neighbours lie in nine rows of three consecutive cells, so in nine runs of the sorted targets,
/// and each run's begin only moves forward as the queries go on: no table of cells, so nothing
/// depends on how large or how empty the world is. Spheres of one class in one cell can't all be
/// apart, so the work is O(N log N + contacts) for each class that is there.
class CellSweep {
 public:
  /// Adds every pair that touches to `pairs` in new chunks, and some that just do not.
  void find_pairs(std::span<const SphereInstance> spheres, const Kernels& kernels, ThreadPool& pool,
                  PairChunks* pairs);

 private:
  struct RadiusBin {
    std::size_t bin;
    std::size_t end;  ///< in order_; begins where the bin before ends
    Real largest;
  };
  struct WideItem {
    std::uint64_t cell;
    std::uint32_t index;
  };
  template <class Item>
  struct ItemBuffers {
    Buffer<Item> items, spare;
  };

  void sort_by_radius(std::span<const SphereInstance> spheres);
  bool is_crowded(const SphereTable& table) const;
  void place(const SphereSubset& subset, bool by_cell, ThreadPool& pool, SphereTable* table);
  template <class Item, class Pack, class Key, class Index>
  void place_by_cell(const SphereSubset& subset, unsigned cell_bits, unsigned low_bit,
                     ThreadPool& pool, ItemBuffers<Item>* buffers, SphereTable* table,
                     const Pack& pack, const Key& key, const Index& index);
  /// `queries` against targets_; among themselves if they are targets_.
  void search(const Kernels& kernels, const SphereTable& queries, bool by_cell, ThreadPool& pool,
              PairChunks* pairs);

  std::vector<RadiusBin> bins_;  ///< those that are not empty, from the largest radii down
  Buffer<std::uint32_t> bin_ends_;
  Buffer<std::uint32_t> order_;  ///< spheres by bin; unused if there is but one
  CellGrid grid_;
  RadixSorter sorter_;
  ItemBuffers<std::uint64_t> items_;  ///< cell and index in one word, where they fit
  ItemBuffers<WideItem> wide_items_;
  SphereTable targets_, queries_;
};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
