/// Vector kernels of the row solver: one table of functions per instruction set.
#pragma once

// The includes are restricted; see src/sphere_collider/cpu/kernels.hpp for the reason.
#include "src/contact_solver/sequential_impulse/row_layout.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

/// Arrays of a sweep. The ids of block i start at 2 * lanes * i: all bodies a, then all bodies b.
struct RowArrays {
  const std::int32_t* ids;
  Real* velocities;
  Real* push_velocities;  ///< velocities of the split impulse, which only correct positions
  const Real* factors;    ///< null if all factors are 1
  Real* contacts;
  Real* frictions;
  std::uint32_t directions;                   ///< friction rows per contact, in consecutive order
  const std::uint32_t* split_impulse_blocks;  ///< blocks with a row of the split impulse
  const std::uint32_t* rolling_friction_blocks;  ///< blocks with rolling or spinning friction
  Real* rolling_frictions;                       ///< kRollingRows rows per block
};

struct RowResidual {
  Real largest = 0;     ///< largest squared residual
  bool broken = false;  ///< whether a residual is NaN
  bool is_exact = true;
  Real enough = 0;  ///< unless `is_exact`, a larger residual ends the search for the largest one
};

/// What the setup of the contacts of a block found, with one bit per lane.
struct ContactSetup {
  unsigned has_second;  ///< whether there is a second friction direction
  unsigned has_split;   ///< whether there is a split impulse
  bool is_regular;      ///< see set_up_frictions
};

/// Sweeps over the blocks [first, last) in their order.
using RowSweep = void (*)(const RowArrays& arrays, std::uint32_t first, std::uint32_t last,
                          RowResidual* residual);

struct RowKernels {
  unsigned lanes;
  /// Sets up the contacts of a block and their friction directions; see set_up_contact().
  /// @param second receives the second directions
  ContactSetup (*set_up_contacts)(const rows::RowSettings& settings, const Real* inputs,
                                  const Real* bodies, const std::int32_t* ids, Real* contacts,
                                  Real* frictions, Real* second);
  /// @return whether the effective masses are normal numbers: a residual is NaN only if an impulse
  /// is
  bool (*set_up_frictions)(const rows::RowSettings& settings, const Real* inputs,
                           const Real* bodies, const std::int32_t* ids, Real* frictions);
  /// See rows::set_up_rolling_axes() and rows::set_up_rolling_frictions().
  void (*set_up_rolling_axes)(const Real* normal, Real* rows);
  /// @return as set_up_frictions
  bool (*set_up_rolling_frictions)(const Real* bodies, const std::int32_t* ids, Real* rows);
  // Index 1: with factors.
  RowSweep warm_starts[2];
  RowSweep contacts[2];
  RowSweep frictions[2];
  RowSweep both[2];               ///< the friction of each block directly after its contacts
  RowSweep split_impulses[2];     ///< blocks are indices into split_impulse_blocks
  RowSweep rolling_frictions[2];  ///< blocks are indices into rolling_friction_blocks
};

extern const RowKernels kScalarRowKernels;
extern const RowKernels kAvx2RowKernels;

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
