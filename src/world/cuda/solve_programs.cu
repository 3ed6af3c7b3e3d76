/// Kernels of the sweeps in worlds of one block.
#include "src/world/cuda/program_kernel.cuh"
#include "src/world/device/solve_program.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

template const void* program_kernel<device::SolveProgram<soft_step::kContactRowKinds>>();
template const void* program_kernel<device::SolveProgram<soft_step::kRowKinds>>();

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
