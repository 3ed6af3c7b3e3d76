/// A body as Bullet's algorithms want to be handed it.
#pragma once

#include <jfpx/config.hpp>

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// As the dispatcher makes it: no child of another shape.
inline btCollisionObjectWrapper wrapper_of(const btCollisionObject& body) {
  return {nullptr, body.getCollisionShape(), &body, body.getWorldTransform(), -1, -1};
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
