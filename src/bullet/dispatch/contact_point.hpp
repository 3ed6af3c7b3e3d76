/// Brings manifolds up to date as Bullet's algorithms would, without them.
#pragma once

#include <jfpx/contact.hpp>
#include <jfpx/math.hpp>

#include "src/bullet/dispatch/packed_body.hpp"

class btCollisionObject;
class btPersistentManifold;

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Whether a global callback would be called for a contact of two spheres, gContactAddedCallback
/// aside, or a user's function may combine the materials of any contact.
bool contacts_are_heard();

/// The collision flags of bodies whose contacts need more than write_contact() does, given that
/// nobody hears it.
int special_collision_flags();

/// False for a contact that is left to Bullet: which NaN an operation returns is up to processor
/// and compiler.
inline bool has_stocks_bits(const PairContact& contact) {
  const Vec3& normal = contact.normal;
  return is_finite(normal.x + normal.y + normal.z + contact.distance);
}

/// Adds the point of a touching pair to an empty manifold that has the bodies in this order: every
/// field of the point gets the bits that Bullet would give it. `radius_b` is that of body b's
/// sphere.
void write_contact(btPersistentManifold* manifold, const PairContact& contact, const BodyState& a,
                   const BodyState& b, Real radius_b);

/// Brings the manifold of a sphere and a box up to date, in this order or the other, as
/// btConvexConvexAlgorithm without perturbation would. The shapes are exactly btSphereShape and
/// btBoxShape.
/// @return false if that takes Bullet's penetration depth solver: nothing was done.
bool update_sphere_box(btPersistentManifold* manifold, const btCollisionObject& body_a,
                       const btCollisionObject& body_b, bool sphere_first);

/// The same for a sphere and a plane, exactly a btStaticPlaneShape, and
/// btConvexPlaneCollisionAlgorithm.
/// @return false if numbers are not finite: nothing was done.
bool update_sphere_plane(btPersistentManifold* manifold, const btCollisionObject& body_a,
                         const btCollisionObject& body_b, bool sphere_first);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
