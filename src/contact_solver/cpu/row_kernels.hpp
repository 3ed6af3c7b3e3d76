/// The vector kernels of the row solver: one table of functions per instruction set.
#pragma once

// What may be included here, and why so little: src/sphere_collider/cpu/kernels.hpp.
#include "src/contact_solver/row_layout.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

/// The arrays that sweeps work on. Block i has ids at 2 * lanes * i: those of all bodies a, then b.
struct RowArrays {
  const std::int32_t* ids;
  Real* velocities;
  Real* pushes;         ///< velocities that only correct positions (the split impulse)
  const Real* factors;  ///< null where all factors are 1
  Real* contacts;
  Real* frictions;
  std::uint32_t directions;          ///< of friction: rows a contact, one after the other
  const std::uint32_t* push_blocks;  ///< blocks with a row that pushes
  const std::uint32_t* rolling_friction_blocks;  ///< blocks with a row against rolling or spinning
  Real* rolling_frictions;                       ///< kRollingFrictionRows of them for each of those
};

using rows::kRollingFrictionRows;

struct RowResidual {
  Real largest = 0;     ///< squared
  bool broken = false;  ///< a residual is not a number
};

/// All run blocks [first, last), one after the other.
using RowSweep = void (*)(const RowArrays& arrays, std::uint32_t first, std::uint32_t last,
                          RowResidual* residual);

struct RowKernels {
  unsigned lanes;
  /// Sets up the contacts of a block, and finds the directions of friction: see set_up_contact().
  /// @return one bit a lane: whether `second` holds the other direction
  unsigned (*set_up_contacts)(const rows::RowSettings& settings, const Real* inputs,
                              const Real* bodies, const std::int32_t* ids, Real* contacts,
                              Real* frictions, Real* second);
  void (*set_up_frictions)(const rows::RowSettings& settings, const Real* inputs,
                           const Real* bodies, const std::int32_t* ids, Real* frictions);
  // [1]: with factors
  RowSweep warm_starts[2];
  RowSweep contacts[2];
  RowSweep frictions[2];
  RowSweep both[2];               ///< contact and friction of a block by turns
  RowSweep pushes[2];             ///< blocks are indices into push_blocks
  RowSweep rolling_frictions[2];  ///< blocks are indices into rolling_friction_blocks
};

extern const RowKernels kScalarRowKernels;
extern const RowKernels kAvx2RowKernels;

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
