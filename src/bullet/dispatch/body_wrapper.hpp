/// Construction of the object wrapper for Bullet's algorithms.
#pragma once

#include <jfpx/config.hpp>

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Equals the dispatcher's wrapper for a body, which is not a child of another shape.
inline btCollisionObjectWrapper wrapper_of(const btCollisionObject& body) {
  return {nullptr, body.getCollisionShape(), &body, body.getWorldTransform(), -1, -1};
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
