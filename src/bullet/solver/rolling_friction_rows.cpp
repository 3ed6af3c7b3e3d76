/// Rows as in btSequentialImpulseConstraintSolver::convertContact() of Bullet 3.24; see the header.
#include "src/bullet/solver/rolling_friction_rows.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// Access to protected functions of Bullet's solver.
struct Access : btSequentialImpulseConstraintSolver {
  using btSequentialImpulseConstraintSolver::applyAnisotropicFriction;
  static constexpr auto set_up() { return &Access::setupTorsionalFrictionConstraint; }
};

class RollingFrictions {
 public:
  RollingFrictions(btSequentialImpulseConstraintSolver& solver, int fixed, btScalar relaxation,
                   const ContactRef& contact, std::size_t lanes)
      : solver_(solver),
        contact_(contact),
        lanes_(lanes),
        relaxation_(relaxation),
        a_(body_of(contact.manifold->getBody0(), fixed)),
        b_(body_of(contact.manifold->getBody1(), fixed)) {}

  void put(const btVector3& axis, btScalar strength, Real* to) const {
    const btVector3 unused_arm(0, 0, 0);
    btSolverConstraint row;
    (solver_.*Access::set_up())(row, axis, a_, b_, contact_.get(), strength, unused_arm, unused_arm,
                                nullptr, nullptr, relaxation_, 0, 0);
    const auto at = [&](int field) { return to + static_cast<std::size_t>(field) * lanes_; };
    const auto put3 = [&](int field, const btVector3& v) {
      for (int i = 0; i < 3; ++i) *at(field + i) = v.m_floats[i];
    };
    *at(rows::kRowPresent) = 1;
    put3(rows::kRowAngularJacobianA, row.m_relpos1CrossNormal);
    put3(rows::kRowAngularJacobianB, row.m_relpos2CrossNormal);
    put3(rows::kRowAngularA, row.m_angularComponentA);
    put3(rows::kRowAngularB, row.m_angularComponentB);
    *at(rows::kRowInverse) = row.m_jacDiagABInv;
    *at(rows::kRowRhs) = row.m_rhs;
    *at(rows::kRowFriction) = row.m_friction;
  }

 private:
  static int body_of(const btCollisionObject* object, int fixed) {
    return object->getCompanionId() >= 0 ? object->getCompanionId() : fixed;
  }

  btSequentialImpulseConstraintSolver& solver_;
  const ContactRef& contact_;
  std::size_t lanes_;
  btScalar relaxation_;
  int a_, b_;
};

}  // namespace

void apply_anisotropic_friction(const ContactRef& contact, btVector3* axis, int mode) {
  for (const btCollisionObject* object :
       {contact.manifold->getBody0(), contact.manifold->getBody1()}) {
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-const-cast): the function only reads
    Access::applyAnisotropicFriction(const_cast<btCollisionObject*>(object), *axis, mode);
  }
}

void set_up_rolling_frictions(btSequentialImpulseConstraintSolver& solver, int fixed,
                              btScalar relaxation, const ContactRef& contact, Real* to,
                              std::size_t lanes) {
  const RollingFrictions rolling_frictions(solver, fixed, relaxation, contact, lanes);
  const btManifoldPoint& point = contact.get();
  const btVector3& normal = point.m_normalWorldOnB;
  rolling_frictions.put(normal, point.m_combinedSpinningFriction, to);
  btVector3 axes[2];
  btPlaneSpace1(normal, axes[0], axes[1]);
  for (btVector3& axis : axes) {
    to += rows::kFrictionFields * lanes;
    axis.normalize();
    apply_anisotropic_friction(contact, &axis, btCollisionObject::CF_ANISOTROPIC_ROLLING_FRICTION);
    if (axis.length() > 0.001) rolling_frictions.put(axis, point.m_combinedRollingFriction, to);
  }
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
