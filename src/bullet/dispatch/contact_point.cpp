/// Specialization of btManifoldResult::addContactPoint for two spheres (btManifoldResult.cpp of
/// Bullet 3.24), and of btConvexConvexAlgorithm without perturbation. The vector arithmetic uses
/// Bullet's inline functions, so the operations are the same.
#include "src/bullet/dispatch/contact_point.hpp"

#include <jfpx/math.hpp>

#include "src/bullet/dispatch/body_wrapper.hpp"
#include "src/bullet/dispatch/convex_distance.hpp"
#include "src/bullet/dispatch/plane_gap.hpp"
#include "src/bullet/dispatch/sphere_plane.hpp"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btConvexShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

#include <new>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// Bullet's limit of combined friction, with its order of comparisons: a NaN is returned unchanged.
btScalar clamp_friction(btScalar friction) {
  constexpr btScalar kMaxFriction = 10;
  if (friction < -kMaxFriction) return -kMaxFriction;
  if (friction > kMaxFriction) return kMaxFriction;
  return friction;
}

void combine_materials(const PackedBody& a, const PackedBody& b, btManifoldPoint* point) {
  point->m_combinedFriction = clamp_friction(a.friction * b.friction);
  point->m_combinedRestitution = a.restitution * b.restitution;
  point->m_combinedRollingFriction =
      clamp_friction(a.rolling_friction * b.friction + b.rolling_friction * a.friction);
  point->m_combinedSpinningFriction =
      clamp_friction(a.spinning_friction * b.friction + b.spinning_friction * a.friction);
}

void write_point(btPersistentManifold* manifold, const PairContact& contact, const PackedBody& a,
                 const PackedBody& b, const btVector3& centre_b, Real radius_b) {
  if (contact.distance > manifold->getContactBreakingThreshold()) return;
  const btVector3 normal(contact.normal.x, contact.normal.y, contact.normal.z);
  const btVector3 on_b = centre_b + radius_b * normal;
  const btVector3 on_a = on_b + normal * contact.distance;

  // btPersistentManifold::addManifoldPoint for an empty manifold. The point is constructed in
  // place, because a copy directly after the writes would stall on store forwarding.
  manifold->setNumContacts(1);
  auto* point = new (&manifold->getContactPoint(0))
      btManifoldPoint(a.pose.invXform(on_a), b.pose.invXform(on_b), normal, contact.distance);
  point->m_positionWorldOnA = on_a;
  point->m_positionWorldOnB = on_b;
  combine_materials(a, b, point);
  btPlaneSpace1(normal, point->m_lateralFrictionDir1, point->m_lateralFrictionDir2);
}

}  // namespace

bool contacts_are_observed() {
  return gContactStartedCallback != nullptr || gContactEndedCallback != nullptr ||
         gContactDestroyedCallback != nullptr || materials_are_combined_by_user();
}

bool materials_are_combined_by_user() {
  return gCalculateCombinedFrictionCallback != &btManifoldResult::calculateCombinedFriction ||
         gCalculateCombinedRestitutionCallback != &btManifoldResult::calculateCombinedRestitution ||
         gCalculateCombinedRollingFrictionCallback !=
             &btManifoldResult::calculateCombinedRollingFriction ||
         gCalculateCombinedSpinningFrictionCallback !=
             &btManifoldResult::calculateCombinedSpinningFriction ||
         gCalculateCombinedContactDampingCallback !=
             &btManifoldResult::calculateCombinedContactDamping ||
         gCalculateCombinedContactStiffnessCallback !=
             &btManifoldResult::calculateCombinedContactStiffness;
}

int special_collision_flags() {
  int special = btCollisionObject::CF_HAS_CONTACT_STIFFNESS_DAMPING |
                btCollisionObject::CF_HAS_FRICTION_ANCHOR;
  if (gContactAddedCallback != nullptr) special |= btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK;
  return special;
}

void write_contact(btPersistentManifold* manifold, const PairContact& contact, const PackedBody& a,
                   const PackedBody& b, Real radius_b) {
  write_point(manifold, contact, a, b, b.pose.getOrigin(), radius_b);
}

void write_contact(btPersistentManifold* manifold, const PairContact& contact, const PackedBody& a,
                   const PackedBody& b, const SphereInstance& sphere_b) {
  const Vec3& centre = sphere_b.centre;
  write_point(manifold, contact, a, b, btVector3(centre.x, centre.y, centre.z), sphere_b.radius);
}

bool update_sphere_plane(btPersistentManifold* manifold, const btCollisionObject& body_a,
                         const btCollisionObject& body_b, bool sphere_first) {
  const btCollisionObject& sphere = sphere_first ? body_a : body_b;
  const btCollisionObject& plane = sphere_first ? body_b : body_a;
  const auto& shape = static_cast<const btSphereShape&>(*sphere.getCollisionShape());
  const btScalar threshold = manifold->getContactBreakingThreshold();
  if (manifold->getNumContacts() == 0 &&
      is_clear_of_plane(sphere, shape.getRadius(), plane, threshold)) {
    return true;
  }
  const SpherePlaneContact contact =
      find_closest_points(sphere.getWorldTransform(), shape, plane.getWorldTransform(),
                          static_cast<const btStaticPlaneShape&>(*plane.getCollisionShape()));
  // The compiler determines which of two NaNs an operation returns.
  const btVector3 sum = contact.normal_on_plane + contact.point_on_plane;
  if (!is_finite(sum.x() + sum.y() + sum.z() + contact.distance)) return false;
  const bool touching = contact.distance < threshold;
  if (!touching && manifold->getNumContacts() == 0) return true;
  const btCollisionObjectWrapper a = wrapper_of(body_a);
  const btCollisionObjectWrapper b = wrapper_of(body_b);
  btManifoldResult result(&a, &b);
  result.setPersistentManifold(manifold);
  if (touching) {
    result.addContactPoint(contact.normal_on_plane, contact.point_on_plane, contact.distance);
  }
  if (manifold->getNumContacts() != 0) result.refreshContactPoints();
  return true;
}

bool update_convex(btPersistentManifold* manifold, const btCollisionObject& body_a,
                   const btCollisionObject& body_b) {
  const btCollisionObjectWrapper a = wrapper_of(body_a);
  const btCollisionObjectWrapper b = wrapper_of(body_b);
  btManifoldResult result(&a, &b);
  return update_convex(manifold, a, b, &result);
}

bool update_convex(btPersistentManifold* manifold, const btCollisionObjectWrapper& a,
                   const btCollisionObjectWrapper& b, btManifoldResult* result) {
  DetectorContact contact;
  const DetectorResult answer =
      find_closest_points({.shape_a = static_cast<const btConvexShape&>(*a.getCollisionShape()),
                           .shape_b = static_cast<const btConvexShape&>(*b.getCollisionShape()),
                           .pose_a = a.getWorldTransform(),
                           .pose_b = b.getWorldTransform(),
                           .threshold = manifold->getContactBreakingThreshold()},
                          &contact);
  if (answer == DetectorResult::unknown) return false;
  if (answer == DetectorResult::apart && manifold->getNumContacts() == 0) return true;
  result->setPersistentManifold(manifold);
  if (answer == DetectorResult::contact) {
    result->addContactPoint(contact.normal_on_b, contact.point_on_b, contact.distance);
  }
  result->refreshContactPoints();
  return true;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
