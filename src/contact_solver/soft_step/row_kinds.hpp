/// The kinds of rows of a soft step, and the groups in which a sweep solves them.
#pragma once

#include "src/contact_solver/soft_step/colors.hpp"
#include "src/contact_solver/soft_step/distance_row.hpp"
#include "src/contact_solver/soft_step/frame_row.hpp"
#include "src/contact_solver/soft_step/manifold_row.hpp"
#include "src/contact_solver/soft_step/sphere_row.hpp"

#include <cstddef>
#include <cstdint>
#include <tuple>
#include <type_traits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// All types of rows. Rows of the overflow are solved in this order of kinds. A type has:
///   - `a`, `b`: its bodies, of which a is movable. On a device, the sweeps and the storage of
///     impulses see other numbers here (see device::RowSolver), and must not index arrays by them;
///   - `Part`: type of the repeated parts of a row, or NoPart. A row with parts has the index
///     `first` of its first part, and their number `count`;
///   - `kReadsRotation`: whether a row reads and changes SolverBody::rotation; `kReadsOrientation`:
///     whether it reads the orientations of its bodies at the time of a sweep;
///   - RowSetup::fill() from a contact or a joint, and RowSetup::store() back to it. The stored
///     values are kept for the next step and in snapshots;
///   - run() of each operation in row_operations.hpp;
///   - store_changes(), except SphereRow.
/// Rows of joints are last.
using RowTypes = std::tuple<SphereRow, ManifoldRow, DistanceRow, FrameRow>;

/// Index of a type in RowTypes.
using RowKind = std::uint8_t;
inline constexpr std::uint32_t kRowKinds = std::tuple_size_v<RowTypes>;
/// Kind of a contact without a row.
inline constexpr RowKind kNoRow = 255;

template <class Row, class... Rows>
constexpr RowKind index_in(const std::tuple<Rows...>*) {
  RowKind index = 0;
  static_cast<void>(((std::is_same_v<Row, Rows> || (++index, false)) || ...));
  return index;
}
template <class Row>
inline constexpr RowKind kKindOf = index_in<Row>(static_cast<RowTypes*>(nullptr));

/// Kind of the rows of a joint. @param type index of the alternative of Joint
JFPX_HD constexpr RowKind kind_of_joint(std::uint32_t type) {
  return type == 0 ? kKindOf<DistanceRow> : kKindOf<FrameRow>;
}

template <class Row>
inline constexpr bool kHasParts = !std::is_same_v<typename Row::Part, NoPart>;

/// Number of kinds of rows of contacts, which precede those of joints.
inline constexpr RowKind kContactRowKinds = kind_of_joint(0);

/// Calls f(std::type_identity<Row>()) for the type of a kind in [kFirst, kEnd).
template <RowKind kFirst = 0, RowKind kEnd = kRowKinds, class F>
JFPX_HD constexpr decltype(auto) visit_row(RowKind kind, const F& f) {
  if constexpr (kFirst + 1u < kEnd) {
    if (kind != kFirst) return visit_row<kFirst + 1, kEnd>(kind, f);
  }
  return f(std::type_identity<std::tuple_element_t<kFirst, RowTypes>>());
}

/// Groups of rows, which a sweep solves one after the other: rows without a color, inner rows, the
/// crossing rows of each color, and rows with an immovable or kinematic body or with the world.
/// Inner rows have no group here, because each block has its own rows; those of a world of one
/// block are in the groups of crossing rows.
inline constexpr std::uint32_t kGroups = kColorsPerClass + 2u;
inline constexpr std::uint32_t kOverflowGroup = 0, kFixedGroup = kGroups - 1;
/// Group of a crossing row. @param number of its color in the class
JFPX_HD constexpr std::uint32_t group_of_crossing(std::uint32_t number) { return 1 + number; }

/// Rows are sorted into bins by kind, then by group.
inline constexpr std::uint32_t kBins = kRowKinds * kGroups;
static_assert(kRowKinds < kNoRow);
JFPX_HD constexpr std::uint16_t bin_of(std::uint32_t kind, std::uint32_t group) {
  return static_cast<std::uint16_t>(kind * kGroups + group);
}

/// Kind of a row, by its number among the rows of all bins.
/// @param begin by bin: its first row
JFPX_HD inline RowKind kind_of_row(const std::uint32_t* begin, std::uint32_t row) {
  RowKind kind = 0;
  while (kind + 1u < kRowKinds && row >= begin[bin_of(kind + 1u, 0)]) ++kind;
  return kind;
}

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
