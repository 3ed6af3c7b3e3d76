/// Updates of manifolds with the results of Bullet's algorithms, computed without calling them.
#pragma once

#include <jfpx/contact.hpp>
#include <jfpx/math.hpp>
#include <jfpx/sphere_collider.hpp>

#include "src/bullet/dispatch/packed_body.hpp"

class btCollisionObject;
struct btCollisionObjectWrapper;
class btManifoldResult;
class btPersistentManifold;

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Whether a user-defined function may combine the materials of a contact.
bool materials_are_combined_by_user();
/// Whether gContactStartedCallback, gContactEndedCallback or gContactDestroyedCallback is set, or
/// materials_are_combined_by_user().
bool contacts_are_observed();

/// The collision flags of bodies for whose contacts write_contact() is insufficient even without
/// callbacks.
int special_collision_flags();

/// False for a contact that Bullet must compute, because the NaN bits of a result depend on the
/// processor and the compiler.
inline bool has_finite_values(const PairContact& contact) {
  const Vec3& normal = contact.normal;
  return is_finite(normal.x + normal.y + normal.z + contact.distance);
}

/// Adds the point of a touching pair to an empty manifold whose bodies are in this order, with
/// Bullet's bits in every field. `radius_b` is the radius of body b's sphere.
void write_contact(btPersistentManifold* manifold, const PairContact& contact, const PackedBody& a,
                   const PackedBody& b, Real radius_b);
/// The same for a sphere of body b that has another centre than the body.
void write_contact(btPersistentManifold* manifold, const PairContact& contact, const PackedBody& a,
                   const PackedBody& b, const SphereInstance& sphere_b);

/// Updates the manifold of two convex shapes, which must be exactly classes of Bullet, like a
/// btConvexConvexAlgorithm that owns it and has no perturbation.
/// @return false, without a change, if the pair needs Bullet's penetration depth solver, or
///   find_closest_points() does not know its shapes
bool update_convex(btPersistentManifold* manifold, const btCollisionObject& body_a,
                   const btCollisionObject& body_b);
/// The same for shapes with other poses than their bodies.
/// @param result for both wrappers
bool update_convex(btPersistentManifold* manifold, const btCollisionObjectWrapper& a,
                   const btCollisionObjectWrapper& b, btManifoldResult* result);

/// Updates the manifold of a sphere and a plane like btConvexPlaneCollisionAlgorithm. The shapes
/// must be exactly btSphereShape and btStaticPlaneShape.
/// @return false, without a change, if a value is not finite
bool update_sphere_plane(btPersistentManifold* manifold, const btCollisionObject& body_a,
                         const btCollisionObject& body_b, bool sphere_first);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
