/// Rows of joints, which are solved serially on the velocities of the row solver.
#pragma once

#include "src/contact_solver/sequential_impulse/cpu/row_solver.hpp"

#include <BulletDynamics/ConstraintSolver/btSolverConstraint.h>
#include <BulletDynamics/ConstraintSolver/btTypedConstraint.h>

#include <span>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Whether all joints are of classes that Bullet defines and act only through their rows.
bool are_known_joints(std::span<btTypedConstraint* const> joints);

/// Solves the rows of btSequentialImpulseConstraintSolver::convertJoints(), and stores the impulses
/// in them.
class JointRows final : public cpu::SerialRows {
 public:
  /// @param ids by solver body: the id, or its complement for a body that rows do not move
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
