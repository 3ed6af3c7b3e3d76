/// Lower bound of the distance that Bullet computes. With the poses x -> B x + c of the body and
/// x -> P x + o of the plane n x = k, the distance of a point v is
///   n P^T (B v + c - o) - k  >=  (P n) (c - o) - k - |B^T P n| |v|.
/// A perturbation selects another point of the shape. The bases need not be orthonormal.
#include "src/bullet/dispatch/plane_gap.hpp"

#include <jfpx/math.hpp>

#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include <cmath>
#include <limits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// Upper bound of the factor by which a matrix scales the length of a vector.
btScalar norm(const btMatrix3x3& m) {
  return square_root(m[0].length2() + m[1].length2() + m[2].length2());
}

}  // namespace

bool is_clear_of_plane(const btCollisionObject& body, btScalar radius,
                       const btCollisionObject& plane, btScalar threshold) {
  radius = std::abs(radius);  // Bullet does not reject negative ones
  const auto& shape = static_cast<const btStaticPlaneShape&>(*plane.getCollisionShape());
  const btTransform &pose = body.getWorldTransform(), &plane_pose = plane.getWorldTransform();
  const btMatrix3x3 &basis = pose.getBasis(), &plane_basis = plane_pose.getBasis();
  const btVector3 normal = plane_basis * shape.getPlaneNormal();
  const btScalar constant = shape.getPlaneConstant();
  const btScalar of_origin = normal.dot(pose.getOrigin() - plane_pose.getOrigin()) - constant;
  const btScalar reach = radius * (normal * basis).length();
  // Exceeds the rounding errors of all operations here and in Bullet together.
  constexpr btScalar kRounding = 256 * std::numeric_limits<btScalar>::epsilon();
  const btScalar size =
      pose.getOrigin().length() + plane_pose.getOrigin().length() + norm(basis) * radius;
  const btScalar error =
      kRounding * (norm(plane_basis) * shape.getPlaneNormal().length() * size + std::abs(constant));
  return of_origin - reach > threshold + error;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
