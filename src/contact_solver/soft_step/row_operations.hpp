/// Operations of the sweeps of a soft step on one row of any kind.
///
/// `kChangesRow`: the operation changes fields of the row. `kMovesBodies`: it changes the shift,
/// the rotation or the free motion of bodies. A device stores only what these flags select; the CPU
/// ignores the flags.
#pragma once

#include "src/contact_solver/soft_step/row_setup.hpp"

#include <concepts>
#include <cstdint>
#include <tuple>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// Arguments of an operation besides the row.
/// @tparam Part    Row::Part
/// @tparam Impacts ImpactBodies, or a type with the same interface for rebound()
template <class Part, class Impacts>
struct RowContext {
  BodyPair bodies;         ///< members that the row does not read are not set
  Part* parts;             ///< of the row; null for NoPart
  const Impacts* impacts;  ///< may be null for a row that does not rebound in a sweep
  PairOrientations orientations = {};
};

struct WarmStart {
  static constexpr bool kChangesRow = false, kMovesBodies = false;
  template <bool kFixed, class Impacts>
  JFPX_HD void run(SphereRow* row, const RowContext<NoPart, Impacts>& c) const {
    warm_start<kFixed>(*row, c.bodies.a, c.bodies.b);
  }
  template <bool kFixed, class Impacts>
  JFPX_HD void run(ManifoldRow* row, const RowContext<PointRow, Impacts>& c) const {
    warm_start<kFixed>(*row, c.parts, c.bodies);
  }
  template <bool kFixed, class Impacts>
  JFPX_HD void run(DistanceRow* row, const RowContext<NoPart, Impacts>& c) const {
    warm_start<kFixed>(*row, c.bodies);
  }
  template <bool kFixed, class Impacts>
  JFPX_HD void run(FrameRow* row, const RowContext<NoPart, Impacts>& c) const {
    warm_start<kFixed>(*row, c.bodies);
  }
};

/// @tparam kUseBias whether it is a bias sweep, which pushes penetrations out, or a relax sweep
template <bool kUseBias>
struct Solve {
  static constexpr bool kChangesRow = true, kMovesBodies = true;
  const StepConstants& constants;
  bool starts = false;  ///< whether the sweep is the first one of a substep
  template <bool kFixed, class Impacts>
  JFPX_HD void run(SphereRow* row, const RowContext<NoPart, Impacts>& c) const {
    solve<kFixed>(row, c.bodies.a, c.bodies.b, constants, *c.impacts, kUseBias);
  }
  template <bool kFixed, class Impacts>
  JFPX_HD void run(ManifoldRow* row, const RowContext<PointRow, Impacts>& c) const {
    solve<kFixed>(row, c.parts, c.bodies, constants, kUseBias);
  }
  template <bool kFixed, class Impacts>
  JFPX_HD void run(DistanceRow* row, const RowContext<NoPart, Impacts>& c) const {
    solve<kFixed>(row, c.bodies, c.orientations, constants, kUseBias, starts);
  }
  template <bool kFixed, class Impacts>
  JFPX_HD void run(FrameRow* row, const RowContext<NoPart, Impacts>& c) const {
    solve<kFixed>(row, c.bodies, c.orientations, constants, kUseBias, starts);
  }
};

/// A bias sweep over the rows of joints only.
struct SolveJoints : Solve<true> {
  using Solve<true>::run;
  template <bool kFixed, class Impacts>
  JFPX_HD void run(SphereRow*, const RowContext<NoPart, Impacts>&) const {}
  template <bool kFixed, class Impacts>
  JFPX_HD void run(ManifoldRow*, const RowContext<PointRow, Impacts>&) const {}
};

/// Restitution of manifolds. Spheres have rebounded in the substeps; joints do not rebound.
struct Restitute {
  static constexpr bool kChangesRow = false, kMovesBodies = false;
  template <bool kFixed, class Impacts>
  JFPX_HD void run(SphereRow*, const RowContext<NoPart, Impacts>&) const {}
  template <bool kFixed, class Impacts>
  JFPX_HD void run(ManifoldRow* row, const RowContext<PointRow, Impacts>& c) const {
    restitute<kFixed>(*row, c.parts, c.bodies);
  }
  template <bool kFixed, class Impacts>
  JFPX_HD void run(DistanceRow*, const RowContext<NoPart, Impacts>&) const {}
  template <bool kFixed, class Impacts>
  JFPX_HD void run(FrameRow*, const RowContext<NoPart, Impacts>&) const {}
};

/// Concept of the types in RowTypes, which documents the requirements.
template <class Row>
concept RowType = requires(Row row, typename Row::Part* parts, const RowSetup& setup,
                           const RowContext<typename Row::Part, ImpactBodies>& context,
                           const StepConstants& constants) {
  { row.a } -> std::convertible_to<std::uint32_t>;
  { row.b } -> std::convertible_to<std::uint32_t>;
  { Row::kReadsRotation } -> std::convertible_to<bool>;
  { Row::kReadsOrientation } -> std::convertible_to<bool>;
  setup.template fill<false>(&row, parts, std::uint32_t{});
  setup.template fill<true>(&row, parts, std::uint32_t{});
  setup.store(row, parts, std::uint32_t{});
  WarmStart().template run<false>(&row, context);
  Solve<true>{constants}.template run<false>(&row, context);
  Solve<false>{constants}.template run<false>(&row, context);
  Restitute().template run<false>(&row, context);
};
template <class... Rows>
constexpr bool are_row_types(const std::tuple<Rows...>*) {
  return (RowType<Rows> && ...);
}
static_assert(are_row_types(static_cast<RowTypes*>(nullptr)));

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
