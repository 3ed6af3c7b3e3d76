/// Kernels between the contact search and the end of a step, except the sweeps, and of edits.
#include "src/world/cuda/program_kernel.cuh"
#include "src/world/device/commit_program.hpp"
#include "src/world/device/edit_program.hpp"
#include "src/world/device/match_program.hpp"
#include "src/world/device/merge_program.hpp"
#include "src/world/device/prepare_program.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

template const void* program_kernel<device::MatchProgram>();
template const void* program_kernel<device::PrepareProgram<device::kPrepareOneBlock>>();
template const void* program_kernel<device::PrepareProgram<device::kPrepareBodies>>();
template const void* program_kernel<device::PrepareProgram<device::kPlaceRows>>();
template const void* program_kernel<device::PrepareProgram<device::kBuildInnerRows>>();
template const void* program_kernel<device::PrepareProgram<device::kBuildRows>>();
template const void* program_kernel<device::CommitProgram>();
template const void* program_kernel<device::EditProgram>();
template const void* program_kernel<device::MergeProgram>();

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
