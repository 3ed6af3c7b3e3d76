/// The neighbors of the points of one system, by position in its bins.
#pragma once

#include <jfpx/neighbors.hpp>

#include "src/sphere_collider/cpu/neighbor_bins.hpp"
#include "src/sphere_collider/cpu/neighbor_cutoffs.hpp"
#include "src/sphere_collider/cpu/neighbor_kernels.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

/// Rows of second points, one after the other.
struct NeighborRows {
  std::vector<std::uint32_t> found;
  std::vector<std::uint32_t> images;  ///< empty if no system has images
};

/// Rows during a search, and memory that one row after the other uses.
struct NeighborScratch {
  bool has_images = false;  ///< whether a system has images
  NeighborRows rows;        ///< may be longer than `size`
  std::size_t size = 0;
  NeighborRows half;
  std::vector<BinRange> ranges;
  std::vector<std::uint32_t> row, row_images, ranks;
  std::vector<std::uint64_t> keys;
};

/// Squares of distances in double that are not close to the square of the cutoff decide a pair; the
/// distance that find_neighbors() documents decides the others.
class NeighborSystem {
 public:
  /// @param first index of the first point in the result
  /// @param cutoffs of all points of the result; like the options, must outlive the system
  /// @throws InvalidArgument as find_neighbors() for the points in the cell
  NeighborSystem(const Lattice& lattice, std::span<const Vec3> points, std::size_t first,
                 const NeighborCutoffs& cutoffs, const NeighborOptions& options);

  bool has_images() const { return bins_.has_images(); }

  /// Appends the rows of the points at positions `begin` to `end` - 1 to scratch->rows, and writes
  /// the size of the row of point i of the result to sizes[i].
  void search(std::size_t begin, std::size_t end, const NeighborKernels& kernels,
              std::span<std::uint64_t> sizes, NeighborScratch* scratch) const;

  /// Writes these rows to the places that found->offsets has for them.
  /// @param from number of the first pair in `rows`
  /// @return the number after the last one
  std::size_t write(std::size_t begin, std::size_t end, const NeighborRows& rows, std::size_t from,
                    Neighbors* found) const;

 private:
  std::uint32_t search_row(std::size_t at, const NeighborKernels& kernels,
                           NeighborScratch* scratch) const;
  /// The same for undivided bins, with a loop over the images of one point after the other, which
  /// finds the row in its order.
  std::uint32_t search_images(std::size_t at, bool both_orders, const NeighborKernels& kernels,
                              NeighborScratch* scratch) const;
  /// search() for all rows of undivided bins in both orders: finds each pair once.
  void search_mirrored(const NeighborKernels& kernels, std::span<std::uint64_t> sizes,
                       NeighborScratch* scratch) const;
  /// A query with the limits of squares for a cutoff.
  NeighborQuery limits(Real cutoff) const;
  /// Whether a pair at the distance that find_neighbors() documents is in the list.
  bool has(std::uint32_t index, std::uint32_t other, std::uint32_t image) const {
    return cutoffs_.has(first_ + index, first_ + other, length(vector(index, other, image)));
  }
  void sort_row(std::uint32_t size, const NeighborKernels& kernels, NeighborScratch* scratch) const;
  ImageShift shift(std::uint32_t index, std::uint32_t other, std::uint32_t image) const;
  Vec3 vector(std::uint32_t index, std::uint32_t other, std::uint32_t image) const {
    return lattice_.image_vector(points_[index], points_[other], shift(index, other, image));
  }

  const NeighborOptions& options_;
  Lattice lattice_;
  std::span<const Vec3> points_;
  std::size_t first_;
  const NeighborCutoffs& cutoffs_;
  NeighborBins bins_;
  NeighborQuery query_;  ///< for the largest cutoff
};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
