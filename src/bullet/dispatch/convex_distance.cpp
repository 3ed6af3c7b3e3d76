/// Selects the cores of two convex shapes.
#include "src/bullet/dispatch/convex_distance.hpp"

#include "src/bullet/dispatch/cores.hpp"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// Calls f(core) for the core of a shape.
/// @param room memory for the points of a hull
/// @return that of f; `unknown` if there is no core for the shape
template <class F>
DetectorResult visit_core(const btConvexShape& shape, const btTransform& pose, HullPoints* room,
                          const F& f) {
  switch (shape.getShapeType()) {
    case SPHERE_SHAPE_PROXYTYPE:
      return f(CenterCore(pose));
    case BOX_SHAPE_PROXYTYPE:
      return f(BoxCore(pose, static_cast<const btBoxShape&>(shape).getImplicitShapeDimensions()));
    case CAPSULE_SHAPE_PROXYTYPE: {
      const auto& capsule = static_cast<const btCapsuleShape&>(shape);
      return f(CapsuleCore(pose, capsule.getUpAxis(), capsule.getHalfHeight()));
    }
    case CYLINDER_SHAPE_PROXYTYPE: {
      const auto& cylinder = static_cast<const btCylinderShape&>(shape);
      return f(CylinderCore(pose, cylinder.getUpAxis(), cylinder.getImplicitShapeDimensions()));
    }
    case CONVEX_HULL_SHAPE_PROXYTYPE: {
      const auto& hull = static_cast<const btConvexHullShape&>(shape);
      const btVector3* const points = hull.getUnscaledPoints();
      if (!room->load(points, hull.getNumPoints())) return DetectorResult::unknown;
      return f(HullCore(pose, points, hull.getLocalScalingNV(), room));
    }
    default:
      return DetectorResult::unknown;
  }
}

/// Whether Bullet has a distance function of its own for both shapes.
bool are_round(int a, int b) {
  const auto is_round = [](int type) {
    return type == SPHERE_SHAPE_PROXYTYPE || type == CAPSULE_SHAPE_PROXYTYPE;
  };
  return is_round(a) && is_round(b);
}

}  // namespace

DetectorResult find_closest_points(const ConvexPairInput& input, DetectorContact* contact) {
  // Not on the stack, which may be small.
  static thread_local HullPoints room_a, room_b;
  const btConvexShape &shape_a = input.shape_a, &shape_b = input.shape_b;
  if (are_round(shape_a.getShapeType(), shape_b.getShapeType())) return DetectorResult::unknown;
  // Relative to the midpoint of the two bodies, for better precision.
  const btVector3 offset = (input.pose_a.getOrigin() + input.pose_b.getOrigin()) * btScalar(0.5);
  btTransform a = input.pose_a, b = input.pose_b;
  a.getOrigin() -= offset;
  b.getOrigin() -= offset;
  DetectorInput detector{.margin_a = shape_a.getMargin(),
                         .margin_b = shape_b.getMargin(),
                         .maximum_distance_squared = 0,
                         .offset = offset};
  const btScalar reach = detector.margin_a + detector.margin_b + input.threshold;
  detector.maximum_distance_squared = reach * reach;
  return visit_core(shape_a, a, &room_a, [&](const auto& core_a) {
    return visit_core(shape_b, b, &room_b, [&](const auto& core_b) {
      return find_closest_points(core_a, core_b, detector, contact);
    });
  });
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
