/// The vector kernels of the CPU sphere collider: one table of functions per instruction set.
#pragma once

// Only macros, types and declarations may be included here, because the sources of the kernels are
// compiled for instruction sets that the processor may not support. An inline function in such a
// source is a COMDAT symbol: the linker keeps one copy for the whole program, possibly the copy of
// that source. Therefore the sources of the kernels use neither standard containers nor Vec3, and
// all their definitions have internal linkage.
#include <jfpx/config.hpp>

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

/// Widest vector, in elements. This many elements after the end of a column are readable.
inline constexpr std::uint32_t kMaxLanes = 16;

/// Spheres as a structure of arrays. `reach` is the extended radius, see extended_radius().
struct SphereColumns {
  const Real* x;
  const Real* y;
  const Real* z;
  const Real* radius;
  const Real* reach;
  const std::uint32_t* id;   ///< index in the caller's order
  const std::int64_t* cell;  ///< ascending; kNoCell in the elements after the last
  std::uint32_t count;
};
inline constexpr std::int64_t kNoCell = INT64_MAX;

inline constexpr std::uint32_t kRows = 9;                  ///< rows of cells around a cell
inline constexpr std::uint32_t kRoom = kRows * kMaxLanes;  ///< a vector of pairs for each row

/// Output of the kernels: pairs, as (lower index << 32) | higher index.
struct PairSink {
  std::uint64_t* next;
  std::uint64_t* end;
  void (*grow)(PairSink* sink);  ///< reserves kRoom more elements; may throw
};

/// Tests queries [first, last) against targets. If `self`, both are the same columns, and each pair
/// is found once.
struct PairSearch {
  SphereColumns queries;
  SphereColumns targets;
  bool self;
  std::uint32_t first;
  std::uint32_t last;
  PairSink* sink;
};

/// Three consecutive cells of targets for each query, starting at `cell + offset`. `cursor` is a
/// target at or before the first of them and advances with the queries.
struct CellRow {
  std::int64_t offset;
  std::uint32_t cursor;
};

/// All functions append every touching pair and no others.
struct Kernels {
  /// Tests every query against every target. If `self`, pairs are ordered by the position of the
  /// first sphere, then of the second.
  void (*search_all)(const PairSearch& search);
  /// Tests every query against the targets in its rows. If `self`, rows[0] is the row of the query
  /// itself, starting at its own cell.
  void (*search_rows)(const PairSearch& search, CellRow* rows, int row_count);
  /// search_rows() with all kRows rows, which is faster if there are several queries in a cell. If
  /// `self`, the pairs of a lower sphere are consecutive.
  void (*search_cells)(const PairSearch& search, CellRow* rows);
};

extern const Kernels kScalarKernels;
extern const Kernels kBaselineKernels;
extern const Kernels kAvx2Kernels;
extern const Kernels kAvx512Kernels;

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
