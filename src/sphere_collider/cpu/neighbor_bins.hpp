/// Points in a lattice, counting-sorted into bins, so that those near a point are in few ranges of
/// contiguous memory.
#pragma once

#include "src/base/interrupt.hpp"
#include "src/sphere_collider/cpu/lattice.hpp"
#include "src/sphere_collider/cpu/neighbor_kernels.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

/// Consecutive positions of an image of the lattice.
struct BinRange {
  std::uint32_t begin, end;
  std::uint32_t image;  ///< its position in NeighborBins::images()
};

/// The planes of a cell, or of the points along an axis that does not repeat, divide each axis of
/// the lattice into bins.
///
/// Claim: a point and an image at a distance of at most `reach` are in bins that differ by at most
/// stencil_[k] along axis k, where images continue the numbers of the bins. The distance of the
/// planes of an axis is `height` per bin; coordinates of the points along the axis differ by at
/// most reach / height bins. A computed coordinate has an error of at most slack bins, which also
/// bounds how far it is moved into the range of the bins. So numbers differ by less than reach /
/// height + 2 slack + 1.
class NeighborBins {
 public:
  /// @param reach [m]
  /// @param first number of the first point in messages
  /// @throws InvalidArgument as find_neighbors() for the points in the cell
  NeighborBins(const Lattice& lattice, std::span<const Vec3> points, double reach,
               std::size_t first = 0);

  /// Bound of the error of a component of a difference of x, y, z and an image vector.
  double error() const { return error_; }

  // Points by position in the order of the bins, then by index.
  std::size_t size() const { return bin_.size(); }
  NeighborColumns points() const { return points_.pointers(); }
  std::uint32_t index(std::size_t position) const { return points_.index[position]; }
  std::size_t bin_of(std::size_t position) const { return bin_[position]; }

  /// Displacements of the points into the cell, by index; empty if there are none.
  const std::vector<ImageShift>& wraps() const { return wraps_; }

  /// Images are numbered by ascending shift.
  const ImageShift& shift(std::uint32_t image) const { return shifts_[image]; }
  /// The images of the origin in the lattice of the basis; indices are their numbers.
  NeighborColumns images() const { return images_.pointers(); }
  std::size_t number_of_images() const { return shifts_.size(); }
  /// Whether the numbers ascend in images().
  bool are_images_sorted() const { return are_images_sorted_; }
  /// The image without a shift.
  std::uint32_t home() const { return home_; }
  bool has_images() const { return shifts_.size() > 1; }
  /// Whether several images of a point may be in the ranges of one bin.
  bool repeats_points() const { return repeats_points_; }
  /// Whether all images of all points are in the ranges of the only bin. Positions are then
  /// indices.
  bool is_undivided() const { return has_images() && start_.size() == 3; }

  /// Writes the points from `first` on that may have an image near `point`, if the bins are
  /// undivided. @return their number
  std::uint32_t find_near(std::size_t point, std::size_t first, std::uint32_t* nearby) const;

  /// Calls body(begin, end) for ranges of images() which contain the images of `other` that are
  /// near `point`, if the bins are undivided.
  template <class Body>
  void for_each_image_range(std::size_t point, std::size_t other, const Body& body) const {
    const Vector &p = coordinates_[point], &q = coordinates_[other];
    std::array<std::int64_t, 3> low, high;
    for (std::size_t k = 0; k < 3; ++k) {
      // The sums are positive, so that conversions round down.
      const std::int64_t positive = axes_[k].images + 2;
      const double at = p[k] - q[k] + static_cast<double>(positive);
      low[k] = static_cast<std::int64_t>(at - axes_[k].reach) + 1 - positive;
      high[k] = static_cast<std::int64_t>(at + axes_[k].reach) - positive;
      low[k] = std::max(low[k], -axes_[k].images);
      high[k] = std::min(high[k], axes_[k].images);
      if (low[k] > high[k]) return;
    }
    for (std::int64_t i = low[0]; i <= high[0]; ++i) {
      body(static_cast<std::uint32_t>(box_index({i, low[1], low[2]})),
           static_cast<std::uint32_t>(box_index({i, high[1], high[2]}) + 1));
    }
  }

  /// The ranges that may have neighbors of the points of a bin.
  void find_ranges(std::size_t bin, std::vector<BinRange>* ranges) const;

 private:
  struct Axis {
    bool repeats = false;
    double low = 0, range = 1;  ///< of the coordinates, in units of the basis
    double height = 0;          ///< [m], distance of the planes of the lattice
    double slack = 0;           ///< error of a coordinate
    std::int64_t count = 1;     ///< number of bins
    double bins_per_unit = 1;
    std::int64_t stencil = 0;
    std::int64_t images = 0;  ///< largest shift along the basis vector that a stencil reaches
    /// More than the difference of the coordinates of neighbors; 0.5 if the axis does not repeat.
    double reach = 0.5;

    /// Coordinates after gaps of the points that are wider than a cutoff, and what has been removed
    /// of the gaps before them; ascending.
    std::vector<std::pair<double, double>> gaps;

    std::int64_t bin(double coordinate) const {
      double at = coordinate - low;
      if (!gaps.empty()) at -= removed_before(coordinate);
      at *= bins_per_unit;
      return at > 0 ? std::min(static_cast<std::int64_t>(at), count - 1) : 0;
    }
    double removed_before(double coordinate) const;
  };
  /// One allocation for the coordinates, because there may be many small systems.
  struct Columns {
    std::vector<double> xyz;
    std::vector<std::uint32_t> index;

    Columns() = default;
    explicit Columns(std::size_t size)
        : xyz(3 * (size + kNeighborLanes)), index(size + kNeighborLanes) {}
    void set(std::size_t at, const Vector& v, std::size_t i) {
      for (std::size_t k = 0; k < 3; ++k) xyz[k * index.size() + at] = v[k];
      index[at] = static_cast<std::uint32_t>(i);
    }
    NeighborColumns pointers() const {
      const double* const x = xyz.data();
      return {x, x + index.size(), x + 2 * index.size(), index.data()};
    }
  };

  void place(const Lattice& lattice, std::span<const Vec3> points, std::size_t first,
             std::vector<Vector>* placed);
  /// The number of cubes as wide as the cutoff in the ranges of the axes.
  double cubes(double reach) const;
  /// Shortens gaps along axes that do not repeat where points are sparse, such as between clusters.
  void remove_gaps(const Lattice& lattice, const std::vector<Vector>& placed, double reach);
  void divide(std::size_t points, double reach);
  void find_images(const Lattice& lattice);
  /// Numbers the images by ascending shift.
  void sort_images();
  void sort(const Lattice& lattice, const std::vector<Vector>& placed);
  std::size_t box_index(const std::array<std::int64_t, 3>& shift) const {
    return static_cast<std::size_t>(
        ((shift[0] + axes_[0].images) * (2 * axes_[1].images + 1) + shift[1] + axes_[1].images) *
            (2 * axes_[2].images + 1) +
        shift[2] + axes_[2].images);
  }

  static constexpr double kMostBinsOfAxis = 1 << 20;

  std::array<Axis, 3> axes_;
  double error_ = 0;
  Columns points_;
  std::vector<std::uint32_t> bin_, start_;
  std::vector<ImageShift> wraps_;
  /// Of the points of undivided bins; 0 along axes that do not repeat.
  std::vector<Vector> coordinates_;
  std::vector<ImageShift> shifts_;
  Columns images_;  ///< by box_index()
  bool are_images_sorted_ = true;
  std::uint32_t home_ = 0;
  bool repeats_points_ = false;
};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
