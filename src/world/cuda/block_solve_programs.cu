/// Kernels of the sweeps in worlds with blocks and rows of several kinds.
#include "src/world/cuda/program_kernel.cuh"
#include "src/world/device/block_solve_program.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

template const void* program_kernel<device::BlockSolveProgram<soft_step::kContactRowKinds>>();
template const void* program_kernel<device::BlockSolveProgram<soft_step::kRowKinds>>();

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
