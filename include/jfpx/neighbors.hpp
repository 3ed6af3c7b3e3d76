/// Neighbor lists of points, also in periodic cells of any shape.
#pragma once

#include <jfpx/periodic.hpp>
#include <jfpx/simd_level.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// A parallelepiped that repeats along some of its three vectors. Points may lie outside of it.
struct TriclinicCell {
  /// [m], rows; double in both precisions. Those along which the cell does not repeat have no
  /// effect, and may be zero.
  std::array<std::array<double, 3>, 3> vectors{};
  std::array<bool, 3> repeats{true, true, true};
};

/// Pairs of a point `first` and an image of a point `second`, sorted by (first, second, shift). The
/// arrays have an element for each pair; the optional ones are empty if they are not requested.
struct Neighbors {
  /// N + 1: the pairs of point i are those from offsets[i] to offsets[i + 1] - 1.
  std::vector<std::uint64_t> offsets;
  std::vector<std::uint32_t> first, second;
  /// The image of `second` is at its point + shift[0] * vectors[0] + shift[1] * vectors[1] +
  /// shift[2] * vectors[2]. Empty without a cell.
  std::vector<ImageShift> shifts;
  std::vector<Real> distances;  ///< [m]
  std::vector<Vec3> vectors;    ///< [m], from `first` to the image of `second`
};

struct NeighborOptions {
  std::optional<TriclinicCell> cell = {};
  /// [m] radius of each point, 0 or in the range of the cutoff: the cutoff of a pair is the sum of
  /// its radii + `cutoff`, which may be 0.
  std::optional<std::span<const Real>> radii = {};
  /// Number of the species of each point, for the next member. Excludes radii.
  std::span<const std::uint32_t> species = {};
  /// [m] symmetric matrix, row by row, of values that are 0 or in the range of the cutoff: the
  /// cutoff of a pair is the value of its species + `cutoff`, which may be 0. Points of species
  /// whose value is 0 are no neighbors.
  std::span<const Real> species_cutoffs = {};
  /// false: first < second, or first == second and a shift whose first component that is not 0 is
  /// positive. true: also the pair in the other order, with the opposite shift and vector.
  bool both_orders = false;
  /// [m], at most the largest cutoff: pairs that are closer are left out
  Real least_distance = 0;
  bool distances = false;
  bool vectors = false;
  unsigned threads = 1;  ///< at most 256; 0: one per core. Has no effect on the result
  SimdLevel simd = SimdLevel::automatic;  ///< widest vectors. Has no effect on the result
};

/// Finds all pairs of points, or of a point and an image, at a distance of at most the cutoff, on
/// the CPU. The cutoff may exceed the cell: then several images of a point are neighbors of another
/// one, and images of a point are neighbors of itself. A point is not a neighbor of itself without
/// a shift; different points at the same position are neighbors.
///
/// The vector of a pair is second - first + shift * vectors, computed from the given points as if
/// it were rounded once to Real in each component, apart from errors of 2^-100 of the terms. Its
/// length sqrt((x*x + y*y) + z*z) is computed in Real, and compared with the cutoff of the pair. So
/// the result depends neither on where in the cell the points are nor on threads or vector width,
/// and in orthogonal cells that find_periodic_contacts() takes, the pairs are the same.
///
/// Points are sorted into bins of a reduced cell (Semaev 2001), so that skewed cells take no more
/// time; the search takes O(N + pairs) time for usual densities, and 8 bytes a pair of memory
/// beyond the result. May be called concurrently.
/// @param points [m], finite; coordinates up to 9e37 in float and 1e150 in double
/// @param cutoff [m], > 0, or with radii or species >= 0; its square must be exact to the precision
///   of Real: from about 1e-15 to 1e19 in float, 1e-146 to 1e154 in double
/// @throws InvalidArgument for a coordinate, a radius, a species or an option out of its range, for
///   more than 2^32 - 1 points; for radii or species of another number of points; for a matrix that
///   is not symmetric; for cell vectors along which the cell repeats that are not finite, exceed
///   2^508, or are linearly dependent to the precision of double; for a point that is 2^22 or more
///   cells from the origin, or shifts beyond 2^24 cells. std::bad_alloc
JFPX_API Neighbors find_neighbors(std::span<const Vec3> points, Real cutoff,
                                  const NeighborOptions& options = {});

/// Finds the neighbors within each of many independent systems: system i consists of the points
/// offsets[i] to offsets[i + 1] - 1. Points of different systems are no neighbors, wherever they
/// are. Indices count all points. The result is that of find_neighbors() for one system after the
/// other; many small systems take less time than as many calls. May be called concurrently.
/// @param offsets ascending, from 0 to the number of points
/// @param cells one for each system, or none: then options.cell is that of each system
/// @throws InvalidArgument as find_neighbors(), for invalid offsets, for another number of cells,
///   and for both `cells` and options.cell. std::bad_alloc
JFPX_API Neighbors find_neighbors_in_systems(std::span<const Vec3> points,
                                             std::span<const std::uint64_t> offsets,
                                             std::span<const TriclinicCell> cells, Real cutoff,
                                             const NeighborOptions& options = {});

}  // namespace JFPX_ABI
}  // namespace jfpx
