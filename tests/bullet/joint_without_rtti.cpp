/// Compiled with -fno-rtti; see the header.
#include "tests/bullet/joint_without_rtti.hpp"

#include <BulletDynamics/ConstraintSolver/btPoint2PointConstraint.h>

namespace jfpx {
namespace {

struct JointWithoutRtti final : btPoint2PointConstraint {
  using btPoint2PointConstraint::btPoint2PointConstraint;
  void solveConstraintObsolete(btSolverBody& a, btSolverBody&, btScalar) override {
    a.internalGetDeltaLinearVelocity() += btVector3(0, btScalar(0.01), 0);
  }
};

}  // namespace

std::unique_ptr<btTypedConstraint> make_joint_without_rtti(btRigidBody& a, btRigidBody& b) {
  return std::make_unique<JointWithoutRtti>(a, b, btVector3(0, 1, 0), btVector3(0, -1, 0));
}

}  // namespace jfpx
