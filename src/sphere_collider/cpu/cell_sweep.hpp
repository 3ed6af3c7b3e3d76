/// Pair search among many spheres of any sizes: sorted cells, with one grid per class of radii.
#pragma once

#include "src/base/radix_sort.hpp"
#include "src/sphere_collider/cpu/cell_grid.hpp"
#include "src/sphere_collider/cpu/pair_chunks.hpp"
#include "src/sphere_collider/cpu/sphere_table.hpp"

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

/// A hierarchical grid (Krijgsman et al. 2014, doi 10.1007/s40571-014-0020-9) without stored cells.
/// Spheres are divided into classes of similar radii. For each class, from the largest radii to the
/// smallest, the spheres of the class (targets) are sorted by cell and tested against each other
/// and against all smaller spheres (queries), which are sorted by the same cells. The neighbours of
/// a query lie in nine rows of three consecutive cells, and therefore in nine runs of the sorted
/// targets. As the queries advance, the beginning of each run only moves forward. There is no table
/// of cells, so time and memory depend neither on the extent of the world nor on empty space. The
/// number of disjoint spheres of one class in one cell is bounded, so the work is O(N log N +
/// contacts) per class.
class CellSweep {
 public:
  /// Appends every touching pair once to `pairs`, in new chunks. Returns the order of these pairs.
  PairOrder find_pairs(std::span<const SphereInstance> spheres, const Kernels& kernels,
                       ThreadPool& pool, PairChunks* pairs);

 private:
  struct RadiusBin {
    std::size_t bin;
    std::size_t end;  ///< in order_; begins at the end of the previous bin
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

  void sort_by_radius(std::span<const SphereInstance> spheres, ThreadPool& pool);
  static double others_per_cell(const SphereTable& table, ThreadPool& pool);
  void fill_table(const SphereSubset& subset, bool by_cell, ThreadPool& pool, SphereTable* table);
  template <class Item, class Pack, class Key, class Index>
  void fill_by_cell(const SphereSubset& subset, unsigned cell_bits, unsigned low_bit,
                    ThreadPool& pool, ItemBuffers<Item>* buffers, SphereTable* table,
                    const Pack& pack, const Key& key, const Index& index);
  /// Tests `queries` against targets_, or among themselves if they are targets_.
  PairOrder search(const Kernels& kernels, const SphereTable& queries, bool by_cell,
                   ThreadPool& pool, PairChunks* pairs);

  std::vector<RadiusBin> bins_;  ///< the bins that are not empty, in descending order of radii
  Buffer<std::uint32_t> bin_ends_;
  Buffer<std::uint32_t> order_;  ///< spheres by bin; unused if there is only one bin
  CellGrid grid_;
  RadixSorter sorter_;
  ItemBuffers<std::uint64_t> items_;  ///< cell and index in one word, if they fit
  ItemBuffers<WideItem> wide_items_;
  SphereTable targets_, queries_;
};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
