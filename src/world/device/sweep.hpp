/// The sweeps of a soft step on a device.
#pragma once

#include "src/contact_solver/soft_step/row_kinds.hpp"
#include "src/contact_solver/soft_step/step_constants.hpp"
#include "src/world/device/step_data.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Work on a body between two sweeps.
enum class BodyStage : std::uint8_t {
  none,
  move,        ///< ends a substep
  accelerate,  ///< starts the next substep
  finish       ///< ends the last sweep
};

/// What a sweep does with the rows.
enum class SweepKind : std::uint8_t {
  none,
  warm_start,
  first_joints,
  joints,
  bias,
  relax,
  restitution
};

/// The sweeps of a step, in the order of SoftStep::solve(): the warm start, those of the substeps,
/// and the restitution of manifolds.
struct SweepList {
  std::uint32_t substeps = 0;
  bool restitutes = false;
  std::uint32_t joint_sweeps = 0;  ///< per substep

  /// Number of sweeps.
  JFPX_HD std::uint32_t size() const { return end_of_substeps() + (restitutes ? 1 : 0); }
  JFPX_HD SweepKind kind(std::uint32_t sweep) const {
    if (sweep >= size()) return SweepKind::none;
    if (sweep == 0) return SweepKind::warm_start;
    if (sweep == end_of_substeps()) return SweepKind::restitution;
    const std::uint32_t k = in_substep(sweep);
    if (k < joint_sweeps) return k == 0 ? SweepKind::first_joints : SweepKind::joints;
    return k == joint_sweeps ? SweepKind::bias : SweepKind::relax;
  }
  /// Work on the bodies between the rows of a sweep and those of the sweep before.
  JFPX_HD BodyStage stage_before(std::uint32_t sweep) const {
    if (sweep == size()) return BodyStage::finish;
    if (sweep < 2 || sweep >= end_of_substeps()) return BodyStage::none;
    if (in_substep(sweep) == 0) return BodyStage::accelerate;
    return in_substep(sweep) == joint_sweeps + 1 ? BodyStage::move : BodyStage::none;
  }
  /// Number of moves of the bodies before the rows of a sweep are solved.
  JFPX_HD std::uint32_t moves(std::uint32_t sweep) const {
    return (sweep + soft_step::kRelaxSweeps - 1) / per_substep();
  }

 private:
  JFPX_HD std::uint32_t end_of_substeps() const { return 1 + substeps * per_substep(); }
  JFPX_HD std::uint32_t per_substep() const { return joint_sweeps + soft_step::kSweepsPerSubstep; }
  /// Number of a sweep of a substep.
  JFPX_HD std::uint32_t in_substep(std::uint32_t sweep) const {
    return (sweep - 1) % per_substep();
  }
};

/// Number of rows without a color, all of which are in the first part. @param begin RowBins::begin
JFPX_HD inline std::uint32_t overflow_rows(const std::uint32_t* begin) {
  std::uint32_t rows = 0;
  for (std::uint32_t kind = 0; kind < soft_step::kRowKinds; ++kind) {
    const std::uint32_t bin = soft_step::bin_of(kind, soft_step::kOverflowGroup);
    rows += begin[bin + 1] - begin[bin];
  }
  return rows;
}

/// The rows of a sweep, except rows of blocks.
struct Sweep {
  const RowBins& bins;         ///< of a part
  const std::uint32_t* begin;  ///< RowBins::begin
  SweepList sweeps;
  std::uint32_t number = 0;
  BodyStage stage = BodyStage::none;  ///< after the rows; not used by BlockSolveProgram

  JFPX_HD Sweep(const RowBins& rows, const SweepList& all)
      : bins(rows), begin(rows.begin), sweeps(all) {}
  JFPX_HD SweepKind kind() const { return sweeps.kind(number); }
  JFPX_HD soft_step::RowKind kind_of(std::uint32_t row) const {
    return soft_step::kind_of_row(begin, row);
  }
  /// RowBins::first of a kind.
  template <class Row>
  JFPX_HD std::uint32_t first() const {
    return bins.first[soft_step::kKindOf<Row>];
  }
  JFPX_HD std::uint32_t size(std::uint32_t bin) const { return begin[bin + 1] - begin[bin]; }
  JFPX_HD std::uint32_t overflow() const { return overflow_rows(begin); }
  JFPX_HD void start(BodyStage next) {
    ++number;
    stage = next;
  }
  /// See SweepList.
  JFPX_HD std::uint32_t moves() const { return sweeps.moves(number); }
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
