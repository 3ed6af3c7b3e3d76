/// A Bullet world as a moment.
#include "src/viewer/bullet_moment.hpp"

#include <BulletDynamics/Dynamics/btRigidBody.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

Vec3 from_bullet(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

std::uint32_t place_of(const btCollisionObject* body) {
  return static_cast<std::uint32_t>(body->getWorldArrayIndex());  // added in the scene's order
}

std::vector<Contact> contacts_of(btCollisionDispatcher& dispatcher) {
  std::vector<Contact> contacts;
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold* manifold = dispatcher.getManifoldByIndexInternal(i);
    for (int k = 0; k < manifold->getNumContacts(); ++k) {
      const btManifoldPoint& point = manifold->getContactPoint(k);
      const btVector3 middle =
          (point.m_positionWorldOnA + point.m_positionWorldOnB) * btScalar(0.5);
      contacts.push_back({place_of(manifold->getBody0()), place_of(manifold->getBody1()),
                          from_bullet(point.m_normalWorldOnB), from_bullet(middle),
                          point.getDistance()});
    }
  }
  return contacts;
}

}  // namespace

Moment moment_of(bullet::SceneWorld& world, std::uint64_t step) {
  Moment moment;
  moment.step = step;
  moment.states = world.states();
  for (const btRigidBody* body : world.bodies()) {
    moment.awake.push_back(body->isActive() || body->isStaticObject() ? 1 : 0);
  }
  moment.contacts = contacts_of(world.dispatcher());
  const bullet::StageTimes& t = world.last_step();
  moment.times = {t.integrate, t.broadphase, t.dispatch, t.islands + t.solve, t.total};
  moment.computed_by = "Bullet";
  if (const bullet::CollisionDispatcher* dispatcher = world.jfpx_dispatcher()) {
    const bullet::DispatchStats& stats = dispatcher->stats();
    if (stats.batches > 0 && stats.last_fallback == bullet::Fallback::none) {
      moment.computed_by = to_string(dispatcher->backend());
    }
    moment.trouble = stats.failure;
  }
  moment.solved_by = "Bullet";
  const auto* solver =
      dynamic_cast<const bullet::ConstraintSolver*>(world.world().getConstraintSolver());
  if (solver != nullptr) {
    const bullet::ConstraintSolverStats& stats = solver->stats();
    if (stats.groups > 0) moment.solved_by = to_string(Backend::cpu);
    if (stats.on_device > 0) moment.solved_by = to_string(Backend::cuda);
    if (moment.trouble.empty()) moment.trouble = stats.device_failure;
  }
  return moment;
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
