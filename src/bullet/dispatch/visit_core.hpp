/// Selects the core of a convex shape.
#pragma once

#include <jfpx/config.hpp>

#include "src/bullet/dispatch/cores.hpp"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Calls f(core) for the core of a shape, which must be exactly a class of Bullet.
/// @param room memory for the points of a hull
/// @return false, without a call, if there is no core for the shape
template <class F>
bool visit_core(const btConvexShape& shape, const btTransform& pose, HullPoints* room, const F& f) {
  switch (shape.getShapeType()) {
    case SPHERE_SHAPE_PROXYTYPE:
      f(CenterCore(pose));
      return true;
    case BOX_SHAPE_PROXYTYPE:
      f(BoxCore(pose, static_cast<const btBoxShape&>(shape).getImplicitShapeDimensions()));
      return true;
    case CAPSULE_SHAPE_PROXYTYPE: {
      const auto& capsule = static_cast<const btCapsuleShape&>(shape);
      f(CapsuleCore(pose, capsule.getUpAxis(), capsule.getHalfHeight()));
      return true;
    }
    case CYLINDER_SHAPE_PROXYTYPE: {
      const auto& cylinder = static_cast<const btCylinderShape&>(shape);
      f(CylinderCore(pose, cylinder.getUpAxis(), cylinder.getImplicitShapeDimensions()));
      return true;
    }
    case CONVEX_HULL_SHAPE_PROXYTYPE: {
      const auto& hull = static_cast<const btConvexHullShape&>(shape);
      const btVector3* const points = hull.getUnscaledPoints();
      if (!room->load(points, hull.getNumPoints())) return false;
      f(HullCore(pose, points, hull.getLocalScalingNV(), room));
      return true;
    }
    default:
      return false;
  }
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
