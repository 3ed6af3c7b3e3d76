/// Definition of the kernels of programs, for the files that instantiate them.
#pragma once

#include "src/world/cuda/grid_team.cuh"
#include "src/world/cuda/program_kernel.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

template <class Program>
__global__ void __launch_bounds__(GridTeam::kThreads, Program::kBlocksPerMultiprocessor)
    run_program(const __grid_constant__ Program program, std::uint32_t* scratch, bool is_cluster,
                const __grid_constant__ TeamParts parts) {
  const GridTeam team(scratch, is_cluster, parts);
  team.sync_parts();
  program(team);
  team.sync_parts();
}

template <class Program>
const void* program_kernel() {
  return reinterpret_cast<const void*>(&run_program<Program>);
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
