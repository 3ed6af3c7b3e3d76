/// Quick test for bodies that are far from a plane.
#pragma once

#include <jfpx/config.hpp>

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Whether btConvexPlaneCollisionAlgorithm, with any perturbation, computes a distance above
/// `threshold` for all points of a convex body and a plane. It then does not change a manifold
/// without points. False if rounding might decide, and for values that are not finite.
/// @param radius [m], of a sphere about the body's origin that contains its shape with its margin
/// @param plane a body with a btStaticPlaneShape
bool is_clear_of_plane(const btCollisionObject& body, btScalar radius,
                       const btCollisionObject& plane, btScalar threshold);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
