/// Rows of joints, solved one after the other on the velocities of the row solver.
#pragma once

#include "src/contact_solver/cpu/row_solver.hpp"

#include <BulletDynamics/ConstraintSolver/btSolverConstraint.h>
#include <BulletDynamics/ConstraintSolver/btTypedConstraint.h>

#include <span>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Whether all are of classes of Bullet's, of which we know that they do all in their rows.
bool are_known_joints(std::span<btTypedConstraint* const> joints);

/// The rows are Bullet's own, as btSequentialImpulseConstraintSolver::convertJoints() makes them;
/// impulses are left in them.
class JointRows final : public cpu::SerialRows {
 public:
  /// @param ids by solver body: the id, with the complement for bodies that rows do not move
  JointRows(cpu::RowSolver& solver, std::span<btSolverConstraint> joint_rows,
            std::span<const std::int32_t> ids)
      : solver_(solver), rows_(joint_rows), ids_(ids) {}

  void sweep(int iteration, cpu::RowResidual* residual) override;

 private:
  btScalar solve(btSolverConstraint& row);

  cpu::RowSolver& solver_;
  std::span<btSolverConstraint> rows_;
  std::span<const std::int32_t> ids_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
