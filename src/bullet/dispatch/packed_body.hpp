/// What a contact needs of a body, side by side: Bullet keeps it in five cache lines of its own.
#pragma once

#include <jfpx/config.hpp>

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

struct BodyState {
  btTransform pose;
  btScalar friction, restitution, rolling_friction, spinning_friction;
};

inline BodyState state_of(const btCollisionObject& body) {
  return {body.getWorldTransform(), body.getFriction(), body.getRestitution(),
          body.getRollingFriction(), body.getSpinningFriction()};
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
