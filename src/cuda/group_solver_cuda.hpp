/// The cuda row of the backend table: groups of contacts.
#pragma once

#include "src/group_solver.hpp"

namespace jfpx::inline JFPX_ABI::cuda {

/// @throws BackendUnavailable, DeviceError
std::unique_ptr<GroupSolver> make_group_solver(int device);

}  // namespace jfpx::inline JFPX_ABI::cuda
