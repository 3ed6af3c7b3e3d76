/// State and output of a sphere search, for the kernels of all searches.
#pragma once

#include <jfpx/contact.hpp>
#include <jfpx/cuda/array_collider.hpp>
#include <jfpx/error.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Largest number of spheres of a search: the grid computes with twice that number in 32 bits.
inline constexpr std::size_t kMaxSpheres = std::size_t{1} << 31;

/// @throws InvalidArgument for more than kMaxSpheres
inline void check_number_of_spheres(std::size_t n) {
  if (n <= kMaxSpheres) return;
  throw InvalidArgument("number of spheres is " + std::to_string(n) + "; it must be at most " +
                        std::to_string(kMaxSpheres));
}

/// Counters that the kernels of one search share. All bytes are zero at the start of a search.
struct alignas(16) SearchState {
  unsigned long long contacts;  ///< contacts that the grid found, without long_row_contacts
  /// Pairs for GridArgs::Rows::overflow, including those beyond its capacity. The single-level
  /// search does not use that array, and counts rows that were not staged here.
  unsigned long long overflow;
  unsigned long long largest_half;   ///< bits of the largest half cell width that a radius requires
  unsigned long long smallest_half;  ///< ~bits of the smallest one
  unsigned long long farthest[6];    ///< ordered bits of the largest x, -x, y, -y, z, -z
  std::uint32_t valid_before;        ///< ~(lowest index of an invalid sphere), 0 if there is none
  std::uint32_t levels;              ///< bit l is set if there are spheres on grid level l
  std::uint32_t long_rows;           ///< entries of GridArgs::Rows::long_rows
  std::uint32_t very_long_rows;      ///< entries of GridArgs::Rows::very_long_rows
  std::uint32_t rows_again;          ///< entries of Table::ranks: see list_row_again()
  std::uint32_t groups_taken;        ///< of spheres in ordered cells, after the first of each warp
  std::uint32_t has_far;             ///< 1: there are spheres far from the origin (grid_cells.hpp)
  std::uint32_t blocks_sampled;      ///< blocks that have finished their part of the sample
  std::uint32_t blocks_counted;      ///< blocks that have counted coarse buckets
  std::uint32_t cell_is_full;        ///< 1: a cell of the direct search has no free slot
  std::uint32_t block_is_full;       ///< 1: a block of the direct search found too many pairs
  unsigned long long long_row_contacts;  ///< contacts of rows that are not staged
  std::uint32_t same_cell[32];           ///< pairs of sampled spheres in one cell, by level
};

/// What a search in a periodic cell has found about its spheres.
struct PeriodicSpheres {
  const SphereInstance* given;  ///< as the user gave them
  PeriodicCell cell;
  std::uint32_t n;       ///< number of reduced spheres and images; 0: some are invalid or missing
  bool may_touch_twice;  ///< whether two spheres may touch through two images
  /// Whether the ids have shift codes, and two spheres touch through one image at most, so that the
  /// codes of a pair determine its shift.
  bool has_shift_codes;
  bool shifts_are_written;  ///< by the search
};
/// Search in a periodic cell: the first spheres of the input are reduced to the cell
/// (periodic_cell.hpp), and the others are images of these. Pairs are tested as given.
struct PeriodicInput {
  PeriodicSpheres* known = nullptr;  ///< in device memory; null: not in a cell
  /// The search is one launch, and the number of spheres is a limit; the exact one is `known->n`.
  /// The result is not valid if that is 0, or if the spheres need several launches: several levels
  /// of the grid, or a hashed table of cells.
  bool is_one_launch = false;
  std::uint32_t spheres = ~0u;         ///< number of reduced spheres
  const std::uint32_t* ids = nullptr;  ///< [n] ids of the spheres and images
  unsigned index_bit = 0;              ///< lowest bit of the index in an id
  Real slack = 0, relative_slack = 0;  ///< see doubt_of()
};

/// Spheres of a search, in device memory.
struct SphereInput {
  const SphereInstance* spheres = nullptr;  ///< null: the spheres are in `arrays`
  std::uint32_t n = 0;
  SphereArrays arrays = {};
  PeriodicInput periodic = {};
  JFPX_HD bool is_periodic() const { return periodic.known != nullptr; }
  /// Number of spheres that have a row of contacts: images have none.
  JFPX_HD std::uint32_t rows() const { return n < periodic.spheres ? n : periodic.spheres; }
};

/// In a periodic cell, the id of a sphere or image has, from the highest bits, the index of the
/// sphere, a shift code unless there are more than kMaxWithShifts spheres, and 1 for an image. In
/// other searches, the id of a sphere is its index.
inline constexpr unsigned kShiftBits = 6;
inline constexpr std::uint32_t kMaxWithShifts = std::uint32_t{1} << (31 - kShiftBits);
static_assert(kMaxSpheres <= std::uint32_t{1} << 31);

/// A given centre, and the cells that its reduced one is displaced by: three numbers, or kFarCells
/// if they have too many bits.
struct alignas(sizeof(SphereInstance)) CellPoint {
  using Cells = std::conditional_t<sizeof(Real) == 4, std::uint32_t, std::uint64_t>;
  static constexpr unsigned kBits = sizeof(Real) == 4 ? 10 : 21;  ///< of each number
  static constexpr Cells kFarCells = ~Cells{0};
  Vec3 centre;
  Cells cells;
};

/// Pairs as two rows of indices: all a's, then all b's.
struct IndexRows {
  void* indices = nullptr;  ///< std::int32_t, or std::int64_t if `is_wide`
  bool is_wide = false;
  unsigned long long length = 0;  ///< of a row: the number of pairs, which the kernels set
  /// Of a search in a periodic cell, or null: receives the shifts of the b's, if the search sets
  /// PeriodicSpheres::shifts_are_written.
  std::int32_t* shifts = nullptr;
  const CellPoint* points = nullptr;  ///< if there are shifts: of the spheres
};

/// Destination of the result of a search: one of `contacts`, `pairs`, `rows` or, within a search,
/// `neighbors`; the others are null.
struct SearchOutput {
  SphereContact* contacts = nullptr;
  SpherePair* pairs = nullptr;
  unsigned long long capacity = 0;
  ContactCount* count = nullptr;
  /// In host memory, or null: receives signal_of() the count with a single store, so that the host
  /// can poll it, before all contacts are written.
  unsigned long long* signal = nullptr;
  IndexRows rows = {};
  std::uint32_t* neighbors = nullptr;  ///< the ids of the b's of the pairs alone
};

/// A ContactCount, without the index of an invalid sphere, in one word.
inline constexpr unsigned long long kSignalIsValid = 1, kSignalIsComplete = 2;
inline constexpr unsigned kSignalBits = 2;
inline constexpr unsigned long long kNoSignal = ~0ull;

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
