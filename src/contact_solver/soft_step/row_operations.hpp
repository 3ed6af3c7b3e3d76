/// Operations of the sweeps of a soft step on one row of either kind. For spheres, `impacts` is
/// ImpactBodies, or a type that rebound() can use in its place.
///
/// `kChangesRow`: the operation changes fields of the row. `kMovesBodies`: it changes the shift,
/// the rotation or the free motion of bodies. A device writes nothing else back; the CPU ignores
/// both.
#pragma once

#include "src/contact_solver/soft_step/manifold_row.hpp"
#include "src/contact_solver/soft_step/sphere_row.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

struct WarmStart {
  static constexpr bool kChangesRow = false, kMovesBodies = false;
  template <bool kFixed, class Impacts>
  JFPX_HD void run(SphereRow* row, SolverBody* a, SolverBody* b, const Impacts&) const {
    warm_start<kFixed>(*row, a, b);
  }
  template <bool kFixed>
  JFPX_HD void run(ManifoldRow* row, PointRow* points, const BodyPair& pair) const {
    warm_start<kFixed>(*row, points, pair);
  }
};

/// @tparam kUseBias whether it is a bias sweep, which pushes penetrations out, or a relax sweep
template <bool kUseBias>
struct Solve {
  static constexpr bool kChangesRow = true, kMovesBodies = true;
  const StepConstants& constants;
  template <bool kFixed, class Impacts>
  JFPX_HD void run(SphereRow* row, SolverBody* a, SolverBody* b, const Impacts& impacts) const {
    solve<kFixed>(row, a, b, constants, impacts, kUseBias);
  }
  template <bool kFixed>
  JFPX_HD void run(ManifoldRow* row, PointRow* points, const BodyPair& pair) const {
    solve<kFixed>(row, points, pair, constants, kUseBias);
  }
};

/// Spheres have rebounded in the substeps.
struct Restitute {
  static constexpr bool kChangesRow = false, kMovesBodies = false;
  template <bool kFixed, class Impacts>
  JFPX_HD void run(SphereRow*, SolverBody*, SolverBody*, const Impacts&) const {}
  template <bool kFixed>
  JFPX_HD void run(ManifoldRow* row, PointRow* points, const BodyPair& pair) const {
    restitute<kFixed>(*row, points, pair);
  }
};

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
