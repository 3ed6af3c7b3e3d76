/// Compact copy of the body fields that a contact reads, which occupy five cache lines in Bullet.
#pragma once

#include <jfpx/config.hpp>

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

struct PackedBody {
  btTransform pose;
  btScalar friction, restitution, rolling_friction, spinning_friction;
};

inline PackedBody state_of(const btCollisionObject& body) {
  return {body.getWorldTransform(), body.getFriction(), body.getRestitution(),
          body.getRollingFriction(), body.getSpinningFriction()};
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
