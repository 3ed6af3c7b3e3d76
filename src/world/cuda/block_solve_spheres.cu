/// Kernel of the sweeps in worlds with blocks whose rows are all of spheres.
#include "src/world/cuda/program_kernel.cuh"
#include "src/world/device/block_solve_program.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

template const void* program_kernel<device::BlockSolveProgram<device::kSphereRowKinds>>();

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
