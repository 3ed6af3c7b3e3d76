/// Kernels of the row solver for any processor: blocks of one row.
#include "src/contact_solver/sequential_impulse/cpu/row_kernels.hpp"
#include "src/contact_solver/sequential_impulse/scalar_lane.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

using Simd = rows::OneLane;

}  // namespace
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx

#include "src/contact_solver/sequential_impulse/cpu/row_kernels.inl"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
const RowKernels kScalarRowKernels = kKernels;
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
