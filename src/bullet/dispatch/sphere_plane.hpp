/// Closest points of a sphere and a plane, equal to those of btConvexPlaneCollisionAlgorithm.
#pragma once

#include <jfpx/config.hpp>

#include <LinearMath/btTransform.h>

class btSphereShape;
class btStaticPlaneShape;

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

struct SpherePlaneContact {
  btVector3 normal_on_plane;
  btVector3 point_on_plane;
  btScalar distance;
};

/// Reproduces btConvexPlaneCollisionAlgorithm::processCollision of Bullet 3.24, operation by
/// operation. The shapes must be of exactly these classes.
SpherePlaneContact find_closest_points(const btTransform& sphere_pose, const btSphereShape& sphere,
                                       const btTransform& plane_pose,
                                       const btStaticPlaneShape& plane);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
