/// Writes the manifold of two spheres as btSphereSphereCollisionAlgorithm would, without it.
#pragma once

#include <jfpx/contact.hpp>

class btCollisionObject;
class btPersistentManifold;

namespace jfpx::inline JFPX_ABI::bullet {

/// False where something other than the manifold's fields depends on who writes the contact: a
/// global callback that would be called, a material that needs more than the defaults, or bodies
/// in the other order. To be asked for every contact, because a callback may change the answer.
bool can_write_flat(const btPersistentManifold& manifold, const btCollisionObject& body_a,
                    const btCollisionObject& body_b);

/// Clears the manifold and, if the pair touches, adds its point: every field of the point gets the
/// bits that Bullet would give it. `radius_b` is the radius of body b's sphere.
void write_contact(btPersistentManifold* manifold, const PairResult& result,
                   const btCollisionObject& body_a, const btCollisionObject& body_b, Real radius_b);

}  // namespace jfpx::inline JFPX_ABI::bullet
