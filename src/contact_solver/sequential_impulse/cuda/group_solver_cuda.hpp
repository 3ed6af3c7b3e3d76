/// Group solver on a GPU: the CUDA entry of group_solver.cpp.
#pragma once

#include "src/contact_solver/sequential_impulse/group_solver.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// @throws BackendUnavailable, DeviceError
std::unique_ptr<GroupSolver> make_group_solver(int device);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
