/// The kernels of the programs of a step. The device compiler takes minutes for all of them, so
/// they are divided among several files, which compile at the same time.
#pragma once

#include <jfpx/config.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// The kernel of a program. Its parameters are the program and those of the GridTeam
/// (program_kernel.cuh). Instantiated in one of the files
/// *_programs.cu or block_solve_spheres.cu; a program that is missing there is a link error.
template <class Program>
const void* program_kernel();

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
