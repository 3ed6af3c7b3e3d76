/// Kernels of the contact search.
#include "src/world/cuda/program_kernel.cuh"
#include "src/world/device/contact_programs.hpp"
#include "src/world/device/force_program.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

template const void* program_kernel<device::ForceProgram>();
template const void* program_kernel<device::BoundsProgram>();
template const void* program_kernel<device::SphereProgram>();

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
