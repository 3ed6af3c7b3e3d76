/// Setup of the bodies of a group, including bodies that only joints or manifolds refer to.
#include "src/bullet/chunks.hpp"
#include "src/bullet/prefetch.hpp"
#include "src/bullet/solver/constraint_solver_impl.hpp"
#include "src/bullet/solver/row_inputs.hpp"

#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

void ConstraintSolver::Impl::set_up_bodies() {
  const Zone zone(*this, "convertBodies");
  const std::size_t count = bodies.size();
  self.m_tmpSolverBodyPool.resizeNoInitialize(0);
  self.m_kinematicBodyUniqueIdToSolverBodyTable.resizeNoInitialize(0);  // used with BT_THREADSAFE
  self.m_tmpSolverBodyPool.reserve(static_cast<int>(count) + 1);
  self.m_tmpSolverBodyPool.resizeNoInitialize(static_cast<int>(count));
  solver.resize_bodies(count + 1);
  flags.assign(count + 1, kInfiniteMass | kImmovable);
  factors = false;
  warm = false;
  in_chunks(pool(), count, kBodiesPerChunk, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      if (i + 8 < last) prefetch_bytes(bodies[i + 8], sizeof(btRigidBody));
      set_up_body(i, bodies[i]);
    }
  });
}

/// Equals Bullet's convertBodies(), with one exception. A body for which Bullet creates no solver
/// body keeps its index and is replaced by the fixed body, which does not change any result.
void ConstraintSolver::Impl::set_up_body(std::size_t i, btCollisionObject* object) {
  object->setCompanionId(-1);
  btSolverBody& body = self.m_tmpSolverBodyPool[static_cast<int>(i)];
  btRigidBody* original = moving_body(object);
  self.initSolverBody(&body, original, settings.dt);
  start(body, i + 1);
  if (original == nullptr) return;
  object->setCompanionId(static_cast<int>(i));
  if (original->getInvMass() != 0) add_gyroscopic_impulses(*info, &body);
  pack(body, i + 1);
  flags[i + 1] = body_flags(*original);
}

void ConstraintSolver::Impl::pack(const btSolverBody& body, std::size_t id) {
  pack_body(body, solver.body(id));
  solver.velocity(id)[3] = solver.push_velocity(id)[3] = body.m_invMass[0];
  pack_factors(body, solver.factors(id));
  const btVector3 ones(1, 1, 1);
  if (body.m_linearFactor != ones || body.m_angularFactor != ones) {
    factors.store(true, std::memory_order_relaxed);
  }
}

/// Sets the position of a body, and its velocities to 0.
void ConstraintSolver::Impl::start(const btSolverBody& body, std::size_t id) {
  const btVector3& position = body.m_worldTransform.getOrigin();
  solver.set_position(id, {position.x(), position.y(), position.z()});
  std::fill_n(solver.velocity(id), rows::kVelocityFields, Real(0));
  std::fill_n(solver.push_velocity(id), rows::kVelocityFields, Real(0));
}

/// Equals Bullet's convertJoints() without its profile zone, which it would enter on any thread.
void ConstraintSolver::Impl::set_up_joint_rows() {
  const Zone zone(*this, "convertJoints");
  for (btTypedConstraint* joint : joints) {
    joint->buildJacobian();
    joint->internalSetAppliedImpulse(0);
  }
  self.m_tmpConstraintSizesPool.resizeNoInitialize(static_cast<int>(joints.size()));
  const auto rows_of = [&](std::size_t i) -> btTypedConstraint::btConstraintInfo1& {
    return self.m_tmpConstraintSizesPool[static_cast<int>(i)];
  };
  int rows = 0;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (btJointFeedback* const feedback = joints[i]->getJointFeedback()) {
      for (btVector3* v : {&feedback->m_appliedForceBodyA, &feedback->m_appliedTorqueBodyA,
                           &feedback->m_appliedForceBodyB, &feedback->m_appliedTorqueBodyB}) {
        v->setZero();
      }
    }
    if (joints[i]->isEnabled()) {
      joints[i]->getInfo1(&rows_of(i));
    } else {
      rows_of(i).m_numConstraintRows = rows_of(i).nub = 0;
    }
    rows += rows_of(i).m_numConstraintRows;
  }
  self.m_tmpSolverNonContactConstraintPool.resizeNoInitialize(rows);
  int row = 0;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const btTypedConstraint::btConstraintInfo1& of_joint = rows_of(i);
    if (of_joint.m_numConstraintRows == 0) continue;
    const int a = self.getOrInitSolverBody(joints[i]->getRigidBodyA(), settings.dt);
    const int b = self.getOrInitSolverBody(joints[i]->getRigidBodyB(), settings.dt);
    self.convertJoint(&self.m_tmpSolverNonContactConstraintPool[row], joints[i], of_joint, a, b,
                      *info);
    row += of_joint.m_numConstraintRows;
  }
}

/// Bullet creates the rows of joints. Assigns ids to the bodies that Bullet adds for them.
void ConstraintSolver::Impl::set_up_joints() {
  btAlignedObjectArray<btSolverBody>& pool = self.m_tmpSolverBodyPool;
  self.m_fixedBodyId = -1;
  self.m_maxOverrideNumSolverIterations = 0;
  for (btTypedConstraint* joint : joints) {
    for (btRigidBody* body : {&joint->getRigidBodyA(), &joint->getRigidBodyB()}) {
      if (body->getCompanionId() < 0 && moving_body(body) != nullptr) {
        joint_unlisted.push_back({body, body->getCompanionId()});
      }
    }
  }
  set_up_joint_rows();
  // Includes joints without rows, whose bodies Bullet adds when it solves the joints.
  for (btTypedConstraint* joint : joints) {
    if (!joint->isEnabled()) continue;
    self.getOrInitSolverBody(joint->getRigidBodyA(), settings.dt);
    self.getOrInitSolverBody(joint->getRigidBodyB(), settings.dt);
  }
  const auto count = static_cast<std::size_t>(pool.size());
  solver.resize_bodies(count + 1);
  flags.resize(count + 1, kInfiniteMass | kImmovable);
  joint_ids.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const btSolverBody& body = pool[static_cast<int>(i)];
    if (i >= bodies.size()) {
      start(body, i + 1);
      if (body.m_originalBody != nullptr) {
        pack(body, i + 1);
        flags[i + 1] = body_flags(*body.m_originalBody);
      }
    }
    const auto id = static_cast<std::int32_t>(i) + 1;
    const bool moved = (flags[i + 1] & kImmovable) == 0;
    joint_ids[i] = body.m_originalBody == nullptr ? rows::kFixedBody : (moved ? id : ~id);
  }
}

/// Adds the bodies that Bullet adds when they first occur in a manifold.
void ConstraintSolver::Impl::set_up_unlisted_bodies(
    std::span<btPersistentManifold* const> manifolds) {
  const auto next_id = static_cast<std::size_t>(self.m_tmpSolverBodyPool.size()) + 1;
  scan.register_unlisted(manifolds, next_id);
  solver.resize_bodies(next_id + scan.unlisted().size());
  for (const UnlistedBody& unlisted : scan.unlisted()) {
    const auto id = static_cast<std::size_t>(unlisted.object->getCompanionId()) + 1;
    btSolverBody& body = self.m_tmpSolverBodyPool.expandNonInitializing();
    self.initSolverBody(&body, unlisted.object, settings.dt);
    start(body, id);
    pack(body, id);
  }
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
