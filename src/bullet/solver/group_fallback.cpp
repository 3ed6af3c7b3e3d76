/// Rules by which a group falls back to Bullet's own solver.
#include "src/base/floating_point.hpp"
#include "src/bullet/solver/constraint_solver_impl.hpp"
#include "src/bullet/solver/joint_rows.hpp"
#include "src/bullet/thread_safe_library.hpp"
#include "src/bullet/virtual_table.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// One residual per iteration is stored and reset for each group. With more iterations, the user
/// iterates until the threshold is reached; Bullet's solver needs no memory for them.
constexpr int kMaxIterations = 1 << 16;
/// SOLVER_SIMD has no effect on Linux; SOLVER_FRICTION_SEPARATE and SOLVER_CACHE_FRIENDLY have no
/// effect at all.
constexpr int kUnsupportedModes = SOLVER_RANDMIZE_ORDER | SOLVER_ENABLE_FRICTION_DIRECTION_CACHING;

}  // namespace

/// The steps of Bullet's solver that this class does not execute one by one, with the overrides of
/// the object's class.
///
/// The functions are read from the virtual table. typeid cannot replace the comparison: a subclass
/// that overrides none of these steps must keep the accelerated solver, and the typeid of a
/// subclass compiled with -fno-rtti is invalid.
ConstraintSolver::Impl::Steps ConstraintSolver::Impl::steps() const {
  return {virtual_function(&self, &ConstraintSolver::convertContacts),
          virtual_function(&self, &ConstraintSolver::convertBodies),
          virtual_function(&self, &ConstraintSolver::convertJoints),
          virtual_function(&self, &ConstraintSolver::solveSingleIteration),
          virtual_function(&self, &ConstraintSolver::solveGroupCacheFriendlySetup),
          virtual_function(&self, &ConstraintSolver::solveGroupCacheFriendlyIterations),
          virtual_function(&self, &ConstraintSolver::solveGroupCacheFriendlySplitImpulseIterations),
          virtual_function(&self, &ConstraintSolver::solveGroupCacheFriendlyFinish)};
}

/// The maximum over the settings of the world and of all joints.
int ConstraintSolver::Impl::max_iterations() const {
  int iterations = info->m_numIterations;
  for (const btTypedConstraint* joint : joints) {
    iterations = std::max(iterations, joint->getOverrideNumSolverIterations());
  }
  return iterations;
}

bool ConstraintSolver::Impl::depends_on_thread_safety(
    std::span<btPersistentManifold* const> manifolds) const {
  const auto depends = [](const btCollisionObject* object) {
    return bullet::depends_on_thread_safety(*object);
  };
  return std::any_of(bodies.begin(), bodies.end(), depends) ||
         std::any_of(manifolds.begin(), manifolds.end(),
                     [&](const btPersistentManifold* manifold) {
                       return depends(manifold->getBody0()) || depends(manifold->getBody1());
                     }) ||
         std::any_of(joints.begin(), joints.end(), [&](const btTypedConstraint* joint) {
           return depends(&joint->getRigidBodyA()) || depends(&joint->getRigidBodyB());
         });
}

std::optional<SolverFallback> ConstraintSolver::Impl::fallback_reason(
    std::span<btPersistentManifold* const> manifolds) const {
  if (manifolds.size() < minimum_batch) return SolverFallback::small;
  if (!rounds_to_nearest()) return SolverFallback::rounding;
  if (steps() != own_steps) return SolverFallback::overridden;
  if ((info->m_solverMode & kUnsupportedModes) != 0 || info->m_numIterations <= 0 ||
      max_iterations() > kMaxIterations) {
    return SolverFallback::mode;
  }
  if (self.m_resolveSingleConstraintRowGeneric != self.getScalarConstraintRowSolverGeneric() ||
      self.m_resolveSingleConstraintRowLowerLimit !=
          self.getScalarConstraintRowSolverLowerLimit() ||
      self.m_resolveSplitPenetrationImpulse != own_split) {
    return SolverFallback::row_solver;
  }
  if (!are_known_joints(joints)) return SolverFallback::constraints;
  if (thread_safe_library && depends_on_thread_safety(manifolds)) {
    return SolverFallback::thread_safe;
  }
  return std::nullopt;
}

/// Restores the companion ids for Bullet's solver.
SolverFallback ConstraintSolver::Impl::restore(SolverFallback reason) {
  for (const UnlistedBody& body : scan.unlisted()) body.object->setCompanionId(body.companion);
  for (const UnlistedBody& body : joint_unlisted) body.object->setCompanionId(body.companion);
  device->abandon();
  return reason;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
