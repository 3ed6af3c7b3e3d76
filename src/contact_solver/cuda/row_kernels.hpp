/// The launchers of the row solver, for host code. All enqueue on a stream, check the launch,
/// allocate nothing and wait for nothing.
#pragma once

#include "src/contact_solver/row_walk.hpp"

#include <cuda_runtime_api.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// What the kernels tell of a group. Zero bytes at the start; followed by two times as many
/// `largest` as the group has iterations: those of the sweeps, then those of the push.
struct RowFindings {
  unsigned long long pushing;  ///< contacts to be pushed apart
  std::uint32_t broken;        ///< 1: something is not a finite number
  std::uint32_t stuck;         ///< 1: walkers waited for ever; the result is worth nothing
  /// Bits of the largest squared residual of an iteration, as a double.
  JFPX_HD unsigned long long* largest() { return reinterpret_cast<unsigned long long*>(this + 1); }
  static constexpr std::size_t bytes(int iterations) {
    return sizeof(RowFindings) + 2 * sizeof(double) * static_cast<std::size_t>(iterations);
  }
};

struct RowSweepArgs {
  rows::RowGroupArrays group;
  rows::RowProgram main, push;
  RowFindings* findings;
  std::uint32_t iterations;  ///< the findings have room for
};

/// Makes the rows, and puts every body's cells at rest.
void launch_row_setup(const RowSweepArgs& args, cudaStream_t stream);

/// Thread blocks of launch_row_sweeps() that `device`, the current one, holds at the same time.
unsigned most_row_blocks(int device);
/// All sweeps and pushes. `most_blocks` is the answer of most_row_blocks().
void launch_row_sweeps(const RowSweepArgs& args, unsigned most_blocks, cudaStream_t stream);

/// Fills outcomes and velocities.
void launch_row_finish(const RowSweepArgs& args, cudaStream_t stream);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
