/// Operations on Bullet worlds shared by the tool's commands.
#include "src/tool/bullet_world.hpp"

#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

bullet::SceneWorld make_bullet_world(EngineKind kind, const Scene& scene,
                                     const RunOptions& options) {
  bullet::SceneWorldOptions world;
  const bool ours = kind == EngineKind::bullet;
  world.dispatcher = ours ? bullet::DispatcherKind::jfpx : bullet::DispatcherKind::stock;
  world.solver =
      ours && options.solver == "jfpx" ? bullet::SolverKind::jfpx : bullet::SolverKind::stock;
  world.world =
      ours && options.world == "jfpx" ? bullet::WorldKind::jfpx : bullet::WorldKind::stock;
  world.dispatch.collider = collider_options(options);
  world.solve.backend = options.backend;
  world.solve.threads = world.step.threads = options.threads;
  if (options.minimum_batch) {
    world.dispatch.minimum_batch = static_cast<std::size_t>(*options.minimum_batch);
    world.solve.minimum_batch = static_cast<std::size_t>(*options.minimum_batch);
  }
  return bullet::SceneWorld(scene, world);
}

std::uint64_t count_contacts(bullet::SceneWorld& world) {
  btCollisionDispatcher& dispatcher = world.dispatcher();
  std::uint64_t contacts = 0;
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    contacts +=
        static_cast<std::uint64_t>(dispatcher.getManifoldByIndexInternal(i)->getNumContacts());
  }
  return contacts;
}

StepMeasures measures_of(bullet::SceneWorld& world) {
  btCollisionDispatcher& dispatcher = world.dispatcher();
  Penetrations penetrations;
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold* manifold = dispatcher.getManifoldByIndexInternal(i);
    if (!manifold->getBody0()->hasContactResponse() ||
        !manifold->getBody1()->hasContactResponse()) {
      continue;
    }
    for (int k = 0; k < manifold->getNumContacts(); ++k) {
      const Real distance = manifold->getContactPoint(k).getDistance();
      if (distance <= 0) penetrations.add(distance);
    }
  }
  Real speed = 0;
  for (const btRigidBody* body : world.bodies()) {
    if (body->isStaticOrKinematicObject()) continue;
    speed = std::max<Real>(speed, body->getLinearVelocity().length());
  }
  return {penetrations.deepest(), penetrations.mean(), speed};
}

std::string sphere_backend(const bullet::SceneWorld& world) {
  const bullet::CollisionDispatcher* dispatcher = world.jfpx_dispatcher();
  if (dispatcher == nullptr || dispatcher->stats().batches == 0) return "Bullet";
  return std::string(to_string(dispatcher->backend()));
}

std::string device_failure(const bullet::SceneWorld& world) {
  const bullet::CollisionDispatcher* dispatcher = world.jfpx_dispatcher();
  if (dispatcher != nullptr && !dispatcher->stats().device_failure.empty()) {
    return dispatcher->stats().device_failure;
  }
  const bullet::ConstraintSolver* solver = world.jfpx_solver();
  return solver == nullptr ? std::string() : solver->stats().device_failure;
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
