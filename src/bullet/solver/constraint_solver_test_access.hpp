/// Access for tests that replace the GPU of a ConstraintSolver.
#pragma once

#include <jfpx/bullet/constraint_solver.hpp>

#include <functional>
#include <memory>

namespace jfpx {
inline namespace JFPX_ABI {

class GroupSolver;

namespace bullet {

struct JFPX_BULLET_API ConstraintSolverTestAccess {
  /// Creates a solver that uses `device` as its GPU, as options.backend specifies.
  static std::unique_ptr<ConstraintSolver> make(std::unique_ptr<GroupSolver> device,
                                                const ConstraintSolverOptions& options);
  /// Creates a solver whose GPU `make` starts as soon as the expected gain exceeds `start_ms`.
  static std::unique_ptr<ConstraintSolver> make(std::function<std::unique_ptr<GroupSolver>()> make,
                                                double start_ms,
                                                const ConstraintSolverOptions& options);
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
