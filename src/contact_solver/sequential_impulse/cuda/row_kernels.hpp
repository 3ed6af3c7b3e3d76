/// Launch functions of the row solver, for host code. Each enqueues work on a stream and checks the
/// launch; none allocates memory or synchronizes.
#pragma once

#include "src/contact_solver/sequential_impulse/dataflow_sweep.hpp"

#include <cuda_runtime_api.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Results of the kernels for a group. All bytes must be 0 at the start. `largest` follows in
/// memory, with two entries per iteration: first those of all sweeps, then those of the split
/// impulse.
struct SweepResults {
  unsigned long long split_impulses;  ///< number of contacts with a split impulse
  std::uint32_t broken;               ///< 1: a value is infinite or NaN
  std::uint32_t stuck;  ///< 1: the dependencies did not resolve; the result is invalid
  /// Bits of the largest squared residual of an iteration, as a double.
  JFPX_HD unsigned long long* largest() { return reinterpret_cast<unsigned long long*>(this + 1); }
  static constexpr std::size_t bytes(int iterations) {
    return sizeof(SweepResults) + 2 * sizeof(double) * static_cast<std::size_t>(iterations);
  }
};

struct RowSweepArgs {
  rows::RowGroupArrays group;
  rows::RowProgram main, split_impulse;
  SweepResults* results;
  std::uint32_t iterations;  ///< capacity of `results`
};

/// Writes the rows, and resets the cells of all bodies to rest.
void launch_row_setup(const RowSweepArgs& args, cudaStream_t stream);

/// The number of thread blocks of launch_row_sweeps() that can be resident on `device`, which must
/// be the current device.
unsigned max_row_blocks(int device);
/// Runs all sweeps, including those of the split impulse.
/// @param max_blocks the result of max_row_blocks()
void launch_row_sweeps(const RowSweepArgs& args, unsigned max_blocks, cudaStream_t stream);

/// Writes outcomes and velocities.
void launch_row_finish(const RowSweepArgs& args, cudaStream_t stream);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
