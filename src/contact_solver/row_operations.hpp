/// Operations of the sweeps of a soft step on one row of either kind.
#pragma once

#include "src/contact_solver/manifold_row.hpp"
#include "src/contact_solver/sphere_row.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

// `bodies` are the pointers to the two bodies of a SphereRow, or the points and the BodyPair of a
// ManifoldRow.

struct WarmStart {
  static constexpr bool kChangesRow = false, kMovesBodies = false;
  template <bool kFixed, class Row, class... Bodies>
  JFPX_HD void run(Row* row, const Bodies&... bodies) const {
    warm_start<kFixed>(*row, bodies...);
  }
};

/// @tparam kSoft whether penetrations are pushed out
template <bool kSoft>
struct Solve {
  static constexpr bool kChangesRow = true, kMovesBodies = kSoft;
  const StepConstants& constants;
  template <bool kFixed, class Row, class... Bodies>
  JFPX_HD void run(Row* row, const Bodies&... bodies) const {
    solve<kFixed>(row, bodies..., constants, kSoft);
  }
};

struct Restitute {
  static constexpr bool kChangesRow = false, kMovesBodies = false;
  template <bool kFixed, class Row, class... Bodies>
  JFPX_HD void run(Row* row, const Bodies&... bodies) const {
    restitute<kFixed>(*row, bodies...);
  }
};

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
