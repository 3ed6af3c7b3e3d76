/// The vector kernels of the x86 sphere collider: one table of functions per instruction set.
#pragma once

// Only macros, types and declarations may be included here: the sources of the kernels are compiled
// for processors that this one may not be. An inline function that such a source emits is a COMDAT
// symbol; the linker keeps one copy for the whole program and may keep that one. Hence no standard
// containers, no Vec3, and everything in the kernels' sources has internal linkage.
#include <jfpx/config.hpp>

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

/// Widest vector, in elements. Columns are followed by so many elements that may be read.
inline constexpr std::uint32_t kMaxLanes = 16;

/// Spheres as a structure of arrays. `reach` is the radius, enlarged: see enlarged_radius().
struct SphereColumns {
  const Real* x;
  const Real* y;
  const Real* z;
  const Real* reach;
  const std::uint32_t* id;   ///< index in the caller's order
  const std::int64_t* cell;  ///< ascending; kNoCell in the elements that follow the last
  std::uint32_t count;
};
inline constexpr std::int64_t kNoCell = INT64_MAX;

/// Where kernels append pairs, as (lower index << 32) | higher index.
struct PairSink {
  std::uint64_t* next;
  std::uint64_t* end;
  void (*grow)(PairSink* sink);  ///< makes room for kMaxLanes more; may throw
};

/// Queries [first, last) against targets; the same columns twice if `self`: then a sphere meets
/// only those behind it.
struct PairSearch {
  SphereColumns queries;
  SphereColumns targets;
  bool self;
  std::uint32_t first;
  std::uint32_t last;
  PairSink* sink;
};

/// Three consecutive cells of the targets for each query: those from `cell + offset` on. `cursor`
/// is a target at or before the first of them; it moves on with the queries.
struct CellRow {
  std::int64_t offset;
  std::uint32_t cursor;
};

/// Both append every pair that touches (DESIGN: filter then exact), and a few that just do not.
struct Kernels {
  /// Every query against every target.
  void (*search_all)(const PairSearch& search);
  /// Every query against the targets in its rows. If `self`, rows[0] is its own row from its own
  /// cell on.
  void (*search_rows)(const PairSearch& search, CellRow* rows, int row_count);
};

extern const Kernels kScalarKernels;
extern const Kernels kSse2Kernels;
extern const Kernels kAvx2Kernels;
extern const Kernels kAvx512Kernels;

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
