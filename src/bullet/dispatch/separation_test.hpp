/// Bullet's test of a convex shape and a triangle along the normal of the triangle.
#pragma once

#include <jfpx/config.hpp>

#include <LinearMath/btTransform.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// The early out of btConvexTriangleCallback::processTriangle of Bullet 3.24, operation by
/// operation.
class SeparationTest {
 public:
  /// @param threshold distance beyond which the shapes are separated
  SeparationTest(const btTransform& triangle_pose, const btTransform& convex_pose,
                 btScalar threshold)
      : triangle_pose_(triangle_pose),
        convex_pose_(convex_pose),
        to_convex_(convex_pose.getBasis().inverse()),
        threshold_(threshold) {}

  /// @param support returns the point of the convex shape, margin included, that is furthest along
  ///   a direction, both in the space of the shape
  template <class Support>
  bool is_separated(const btVector3* triangle, const Support& support) const {
    const btVector3 v0 = triangle_pose_ * triangle[0];
    const btVector3 v1 = triangle_pose_ * triangle[1];
    const btVector3 v2 = triangle_pose_ * triangle[2];
    btVector3 normal = (v1 - v0).cross(v2 - v0);
    normal.normalize();
    if (is_behind(v0, normal, support)) return true;
    normal *= -1;
    return is_behind(v0, normal, support);
  }

 private:
  /// Whether the convex shape is behind the plane through `v0`.
  template <class Support>
  bool is_behind(const btVector3& v0, const btVector3& normal, const Support& support) const {
    const btVector3 furthest = convex_pose_ * support(to_convex_ * normal);
    return normal.dot(v0) - normal.dot(furthest) > threshold_;
  }

  const btTransform &triangle_pose_, &convex_pose_;
  btMatrix3x3 to_convex_;
  btScalar threshold_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
