/// Detection of the flag by its effect on a constructor of the library.
#include "src/bullet/thread_safe_library.hpp"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

// btCreateDefaultTaskScheduler() would also show the flag, but it starts threads, and its
// destruction resets the thread indices of a scheduler of the program.
bool is_thread_safe_library() {
  // One stack for ray tests per thread that Bullet supports.
  static const bool result = btDbvtBroadphase().m_rayTestStacks.size() > 1;
  return result;
}

bool depends_on_thread_safety(const btCollisionObject& object) {
  const btRigidBody* body = btRigidBody::upcast(&object);
  if (body == nullptr) return false;
  if (!body->isKinematicObject()) return (body->getInvMass() != 0) == body->isStaticObject();
  const btMatrix3x3& inertia = body->getInvInertiaTensorWorld();
  const bool moves = body->getInvMass() != 0 || !inertia[0].isZero() || !inertia[1].isZero() ||
                     !inertia[2].isZero();
  return moves || body->getWorldArrayIndex() < 0;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
