/// Bitwise comparison of two Bullet worlds.
#include <jfpx/bullet/verify.hpp>

#include "src/bullet/dispatch/point_fields.hpp"

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletDynamics/ConstraintSolver/btTypedConstraint.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <cstdio>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

Difference to_difference(const FieldDifference& field, const char* what, std::uint64_t index,
                         std::uint64_t other, std::uint64_t step) {
  return {step,
          what,
          index,
          other,
          field.field,
          field.expected,
          field.actual,
          field.expected_bits,
          field.actual_bits};
}

std::optional<Difference> compare_manifolds(const btPersistentManifold& e,
                                            const btPersistentManifold& a, std::uint64_t index,
                                            std::uint64_t step) {
  FieldComparison compare;
  compare("body 0", e.getBody0()->getWorldArrayIndex(), a.getBody0()->getWorldArrayIndex());
  compare("body 1", e.getBody1()->getWorldArrayIndex(), a.getBody1()->getWorldArrayIndex());
  compare("breaking threshold", e.getContactBreakingThreshold(), a.getContactBreakingThreshold());
  compare("processing threshold", e.getContactProcessingThreshold(),
          a.getContactProcessingThreshold());
  compare("m_companionIdA", e.m_companionIdA, a.m_companionIdA);
  compare("m_companionIdB", e.m_companionIdB, a.m_companionIdB);
  compare("m_index1a", e.m_index1a, a.m_index1a);
  compare("number of points", e.getNumContacts(), a.getNumContacts());
  if (compare.first()) return to_difference(*compare.first(), "manifold", index, 0, step);
  for (int i = 0; i < e.getNumContacts(); ++i) {
    FieldComparison points;
    compare_points(e.getContactPoint(i), a.getContactPoint(i), &points);
    if (points.first()) {
      return to_difference(*points.first(), "manifold", index, static_cast<std::uint64_t>(i), step);
    }
  }
  return std::nullopt;
}

void compare_proxies(const btBroadphaseProxy& e, const btBroadphaseProxy& a, FieldComparison* c) {
  // Not every getAabb() sets the unused component.
  const auto used = [](const btVector3& v) { return btVector3(v.x(), v.y(), v.z()); };
  (*c)("lower bound", used(e.m_aabbMin), used(a.m_aabbMin));
  (*c)("upper bound", used(e.m_aabbMax), used(a.m_aabbMax));
}

void compare_bodies(const btCollisionObject& e, const btCollisionObject& a, FieldComparison* c) {
  (*c)("transform", e.getWorldTransform(), a.getWorldTransform());
  (*c)("interpolation transform", e.getInterpolationWorldTransform(),
       a.getInterpolationWorldTransform());
  (*c)("interpolation linear velocity", e.getInterpolationLinearVelocity(),
       a.getInterpolationLinearVelocity());
  (*c)("interpolation angular velocity", e.getInterpolationAngularVelocity(),
       a.getInterpolationAngularVelocity());
  (*c)("activation state", e.getActivationState(), a.getActivationState());
  (*c)("deactivation time", e.getDeactivationTime(), a.getDeactivationTime());
  (*c)("island tag", e.getIslandTag(), a.getIslandTag());
  (*c)("collision flags", e.getCollisionFlags(), a.getCollisionFlags());
  (*c)("hit fraction", e.getHitFraction(), a.getHitFraction());
  const btBroadphaseProxy *proxy_e = e.getBroadphaseHandle(), *proxy_a = a.getBroadphaseHandle();
  (*c)("is in the broadphase", proxy_e != nullptr ? 1 : 0, proxy_a != nullptr ? 1 : 0);
  if (proxy_e != nullptr && proxy_a != nullptr) compare_proxies(*proxy_e, *proxy_a, c);
  const btRigidBody* body_e = btRigidBody::upcast(&e);
  const btRigidBody* body_a = btRigidBody::upcast(&a);
  (*c)("is a rigid body", body_e != nullptr ? 1 : 0, body_a != nullptr ? 1 : 0);
  if (body_e == nullptr || body_a == nullptr) return;
  (*c)("linear velocity", body_e->getLinearVelocity(), body_a->getLinearVelocity());
  (*c)("angular velocity", body_e->getAngularVelocity(), body_a->getAngularVelocity());
  (*c)("total force", body_e->getTotalForce(), body_a->getTotalForce());
  (*c)("total torque", body_e->getTotalTorque(), body_a->getTotalTorque());
}

void compare_joints(const btTypedConstraint& e, const btTypedConstraint& a, FieldComparison* c) {
  (*c)("type", e.getConstraintType(), a.getConstraintType());
  (*c)("enabled", e.isEnabled() ? 1 : 0, a.isEnabled() ? 1 : 0);
  // Without the function's assertion that the user has asked for feedback.
  const auto impulse = [](const btTypedConstraint& joint) {
    return const_cast<btTypedConstraint&>(joint).internalGetAppliedImpulse();
  };
  (*c)("applied impulse", impulse(e), impulse(a));
}

}  // namespace

std::optional<Difference> first_difference(btDynamicsWorld& expected, btDynamicsWorld& actual,
                                           std::uint64_t step) {
  btDispatcher& de = *expected.getDispatcher();
  btDispatcher& da = *actual.getDispatcher();
  FieldComparison counts;
  counts("number of manifolds", de.getNumManifolds(), da.getNumManifolds());
  counts("number of bodies", expected.getNumCollisionObjects(), actual.getNumCollisionObjects());
  counts("number of joints", expected.getNumConstraints(), actual.getNumConstraints());
  if (counts.first()) return to_difference(*counts.first(), "world", 0, 0, step);
  for (int i = 0; i < de.getNumManifolds(); ++i) {
    auto difference =
        compare_manifolds(*de.getManifoldByIndexInternal(i), *da.getManifoldByIndexInternal(i),
                          static_cast<std::uint64_t>(i), step);
    if (difference) return difference;
  }
  const btCollisionObjectArray& bodies_e = expected.getCollisionObjectArray();
  const btCollisionObjectArray& bodies_a = actual.getCollisionObjectArray();
  for (int i = 0; i < bodies_e.size(); ++i) {
    FieldComparison compare;
    compare_bodies(*bodies_e[i], *bodies_a[i], &compare);
    if (compare.first()) {
      return to_difference(*compare.first(), "body", static_cast<std::uint64_t>(i), 0, step);
    }
  }
  for (int i = 0; i < expected.getNumConstraints(); ++i) {
    FieldComparison compare;
    compare_joints(*expected.getConstraint(i), *actual.getConstraint(i), &compare);
    if (compare.first()) {
      return to_difference(*compare.first(), "joint", static_cast<std::uint64_t>(i), 0, step);
    }
  }
  return std::nullopt;
}

std::string to_text(const Difference& d) {
  char place[96];
  if (d.what == "world") {
    std::snprintf(place, sizeof place, "step %llu, world, ",
                  static_cast<unsigned long long>(d.step));
  } else {
    const char* format = d.what == "manifold" ? "step %llu, %s %llu point %llu, "
                         : d.what == "pair"   ? "step %llu, %s of bodies %llu and %llu, "
                                              : "step %llu, %s %llu, ";
    std::snprintf(place, sizeof place, format, static_cast<unsigned long long>(d.step),
                  d.what.c_str(), static_cast<unsigned long long>(d.index),
                  static_cast<unsigned long long>(d.other));
  }
  return place +
         to_text(FieldDifference{d.field, d.expected, d.actual, d.expected_bits, d.actual_bits});
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
