/// The lowest point of a sphere above a plane, as in btSphereShape. The arithmetic uses Bullet's
/// inline functions.
#include "src/bullet/dispatch/sphere_plane.hpp"

#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

SpherePlaneContact find_closest_points(const btTransform& sphere_pose, const btSphereShape& sphere,
                                       const btTransform& plane_pose,
                                       const btStaticPlaneShape& plane) {
  const btVector3& normal = plane.getPlaneNormal();
  const btTransform plane_in_sphere = sphere_pose.inverse() * plane_pose;
  const btTransform sphere_in_plane = plane_pose.inverse() * sphere_pose;
  const btVector3 lowest = sphere_in_plane(
      sphere.btSphereShape::localGetSupportingVertex(plane_in_sphere.getBasis() * -normal));
  const btScalar distance = normal.dot(lowest) - plane.getPlaneConstant();
  return {plane_pose.getBasis() * normal, plane_pose * (lowest - distance * normal), distance};
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
