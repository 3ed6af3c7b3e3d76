/// Kernel of the contacts of shapes.
#include "src/world/cuda/program_kernel.cuh"
#include "src/world/device/contact_programs.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

template const void* program_kernel<device::ShapeProgram>();

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
