/// Selection of the group solvers that this build contains.
#include "src/contact_solver/sequential_impulse/group_solver.hpp"

#if JFPX_HAS_CUDA
#include "src/contact_solver/sequential_impulse/cuda/group_solver_cuda.hpp"
#endif

namespace jfpx {
inline namespace JFPX_ABI {

GroupSolverMaker cuda_group_solver_maker([[maybe_unused]] int device) {
#if JFPX_HAS_CUDA
  return [device] { return cuda::make_group_solver(device); };
#else
  return nullptr;
#endif
}

}  // namespace JFPX_ABI
}  // namespace jfpx
