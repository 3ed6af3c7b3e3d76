/// Conversion of settings, bodies and contacts; see the header.
#include "src/bullet/solver/row_inputs.hpp"

#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

void put(Real* to, const btVector3& v) { std::copy_n(v.m_floats, 3, to); }

/// Softness (cfm) and error reduction (erp) of a contact.
void contact_softness(const btManifoldPoint& point, const btContactSolverInfo& info, Real* cfm,
                      Real* erp) {
  const int flags = point.m_contactPointFlags;
  *cfm = info.m_globalCfm;
  *erp = info.m_erp2;
  if ((flags & (BT_CONTACT_FLAG_HAS_CONTACT_CFM | BT_CONTACT_FLAG_HAS_CONTACT_ERP)) != 0) {
    if ((flags & BT_CONTACT_FLAG_HAS_CONTACT_CFM) != 0) *cfm = point.m_contactCFM;
    if ((flags & BT_CONTACT_FLAG_HAS_CONTACT_ERP) != 0) *erp = point.m_contactERP;
  } else if ((flags & BT_CONTACT_FLAG_CONTACT_STIFFNESS_DAMPING) != 0) {
    btScalar denominator =
        info.m_timeStep * point.m_combinedContactStiffness1 + point.m_combinedContactDamping1;
    if (denominator < SIMD_EPSILON) denominator = SIMD_EPSILON;
    *cfm = btScalar(1) / denominator;
    *erp = (info.m_timeStep * point.m_combinedContactStiffness1) / denominator;
  }
}

}  // namespace

rows::RowSettings row_settings(const btContactSolverInfo& info) {
  return {.dt = info.m_timeStep,
          .inverse_dt = btScalar(1) / info.m_timeStep,
          .relaxation = info.m_sor,
          .restitution_threshold = info.m_restitutionVelocityThreshold,
          .slop = info.m_linearSlop,
          .split_threshold = info.m_splitImpulsePenetrationThreshold,
          .friction_erp = info.m_frictionERP,
          .warm_factor = info.m_warmstartingFactor,
          .epsilon = SIMD_EPSILON,
          .split = info.m_splitImpulse != 0,
          .warm_start = (info.m_solverMode & SOLVER_USE_WARMSTARTING) != 0,
          .friction_follows_velocity =
              (info.m_solverMode & SOLVER_DISABLE_VELOCITY_DEPENDENT_FRICTION_DIRECTION) == 0};
}

void add_gyroscopic_impulses(const btContactSolverInfo& info, btSolverBody* body) {
  const btRigidBody& original = *body->m_originalBody;
  const int flags = original.getFlags();
  if ((flags & BT_ENABLE_GYROSCOPIC_FORCE_EXPLICIT) != 0) {
    body->m_externalTorqueImpulse -=
        original.computeGyroscopicForceExplicit(info.m_maxGyroscopicForce) *
        original.getInvInertiaTensorWorld() * info.m_timeStep;
  }
  if ((flags & BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_WORLD) != 0) {
    body->m_externalTorqueImpulse +=
        original.computeGyroscopicImpulseImplicit_World(info.m_timeStep);
  }
  if ((flags & BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY) != 0) {
    body->m_externalTorqueImpulse +=
        original.computeGyroscopicImpulseImplicit_Body(info.m_timeStep);
  }
}

void pack_body(const btSolverBody& body, Real* to) {
  const btRigidBody& original = *body.m_originalBody;
  const btVector3 factor = original.getAngularFactor();
  const btVector3 columns[] = {original.getWorldTransform().getOrigin(), body.m_linearVelocity,
                               body.m_angularVelocity,
                               body.m_linearVelocity + body.m_externalForceImpulse,
                               body.m_angularVelocity + body.m_externalTorqueImpulse};
  for (int i = 0; i < 5; ++i) put(to + 4 * i, columns[i]);
  for (int i = 0; i < 3; ++i) put(to + 20 + 4 * i, original.getInvInertiaTensorWorld()[i]);
  to[3] = original.getInvMass();
  for (int i = 0; i < 3; ++i) to[7 + 4 * i] = factor[i];
  to[19] = to[23] = to[27] = to[31] = 0;
}

void pack_factors(const btSolverBody& body, Real* to) {
  std::fill_n(to, rows::kFactorFields, Real(0));
  put(to, body.m_invMass);
  put(to + 4, body.m_linearFactor);
  put(to + 8, body.m_angularFactor);
}

void pack_contact(const btManifoldPoint& point, const btContactSolverInfo& info, std::size_t lanes,
                  Real* to) {
  const auto put3 = [&](std::size_t field, const btVector3& v) {
    for (std::size_t i = 0; i < 3; ++i) to[(field + i) * lanes] = v.m_floats[i];
  };
  put3(rows::kInNormal, point.m_normalWorldOnB);
  put3(rows::kInPointA, point.m_positionWorldOnA);
  put3(rows::kInPointB, point.m_positionWorldOnB);
  to[rows::kInDistance * lanes] = point.m_distance1;
  to[rows::kInFriction * lanes] = point.m_combinedFriction;
  to[rows::kInRestitution * lanes] = point.m_combinedRestitution;
  to[rows::kInImpulse * lanes] = point.m_appliedImpulse;
  contact_softness(point, info, to + rows::kInCfm * lanes, to + rows::kInErp * lanes);
  to[rows::kInAnchor * lanes] =
      (point.m_contactPointFlags & BT_CONTACT_FLAG_FRICTION_ANCHOR) != 0 ? Real(1) : Real(0);
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
