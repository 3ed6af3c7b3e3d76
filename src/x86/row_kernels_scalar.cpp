/// The kernels of the row solver for any processor: blocks of one row.
#include "src/shared/one_lane.hpp"
#include "src/x86/row_kernels.hpp"

namespace jfpx::inline JFPX_ABI::x86 {
namespace {

using Simd = rows::OneLane;

}  // namespace
}  // namespace jfpx::inline JFPX_ABI::x86

#include "src/x86/row_kernels.inl"

namespace jfpx::inline JFPX_ABI::x86 {
const RowKernels kScalarRowKernels = kKernels;
}  // namespace jfpx::inline JFPX_ABI::x86
