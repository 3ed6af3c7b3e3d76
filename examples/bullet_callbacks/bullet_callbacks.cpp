/// Bullet's contact callbacks, a custom material and a sensor. With the argument `stock`, the
/// program uses Bullet's own dispatcher and prints the same.
#include <jfpx/bullet/dispatcher.hpp>

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <btBulletDynamicsCommon.h>

#include <cstdio>
#include <memory>
#include <string_view>
#include <vector>

namespace {

constexpr int kBodies = 200;
constexpr int kSensor = kBodies - 1;  ///< user index of the body without contact response

struct Calls {
  int started = 0, ended = 0, added = 0, sensor = 0;
};
Calls g_calls;

bool is_sensor(const btCollisionObject* body) { return body->getUserIndex() == kSensor; }

void on_started(btPersistentManifold* const& manifold) {
  ++g_calls.started;
  if (is_sensor(manifold->getBody0()) || is_sensor(manifold->getBody1())) ++g_calls.sensor;
}
void on_ended(btPersistentManifold* const&) { ++g_calls.ended; }

/// Every third body is icy: its contacts have low friction.
bool on_added(btManifoldPoint& point, const btCollisionObjectWrapper*, int, int,
              const btCollisionObjectWrapper*, int, int) {
  point.m_combinedFriction = btScalar(0.01);
  ++g_calls.added;
  return true;
}

std::unique_ptr<btCollisionDispatcher> make_dispatcher(bool stock,
                                                       btCollisionConfiguration* configuration) {
  if (stock) return std::make_unique<btCollisionDispatcher>(configuration);
  // Also batches small dispatches, to show that callbacks receive the same calls.
  return std::make_unique<jfpx::bullet::CollisionDispatcher>(
      configuration, jfpx::bullet::DispatcherOptions{.minimum_batch = 0});
}

/// Adds spheres in a narrow heap. The last one, in the top layer, is a sensor: it falls through the
/// others and the ground.
void fill(btDiscreteDynamicsWorld* world, btCollisionShape* shape,
          std::vector<std::unique_ptr<btRigidBody>>* bodies) {
  btVector3 inertia;
  shape->calculateLocalInertia(1, inertia);
  for (int i = 0; i < kBodies; ++i) {
    bodies->push_back(std::make_unique<btRigidBody>(1, nullptr, shape, inertia));
    btRigidBody& body = *bodies->back();
    body.setUserIndex(i);
    const int column = i % 4, row = i / 4 % 4, layer = i / 16;
    body.getWorldTransform().setOrigin(
        btVector3(btScalar(column) * btScalar(0.9) + btScalar(0.01) * btScalar(i),
                  btScalar(0.5) + btScalar(layer) * btScalar(0.9), btScalar(row) * btScalar(0.9)));
    int flags = body.getCollisionFlags();
    if (i % 3 == 0) flags |= btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK;
    if (i == kSensor) flags |= btCollisionObject::CF_NO_CONTACT_RESPONSE;
    body.setCollisionFlags(flags);
    world->addRigidBody(&body);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const bool stock = argc > 1 && std::string_view(argv[1]) == "stock";
  btDefaultCollisionConfiguration configuration;
  const auto dispatcher = make_dispatcher(stock, &configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(dispatcher.get(), &broadphase, &solver, &configuration);

  btStaticPlaneShape ground_shape(btVector3(0, 1, 0), 0);
  btRigidBody ground(0, nullptr, &ground_shape);
  btSphereShape sphere_shape(btScalar(0.5));
  std::vector<std::unique_ptr<btRigidBody>> bodies;
  world.addRigidBody(&ground);
  fill(&world, &sphere_shape, &bodies);

  gContactStartedCallback = on_started;
  gContactEndedCallback = on_ended;
  gContactAddedCallback = on_added;
  for (int second = 1; second <= 3; ++second) {
    for (int step = 0; step < 60; ++step) world.stepSimulation(btScalar(1) / 60, 1);
    std::printf("second %d: %d started, %d ended, %d icy, %d at the sensor; sphere 0 at %a\n",
                second, g_calls.started, g_calls.ended, g_calls.added, g_calls.sensor,
                double(bodies[0]->getWorldTransform().getOrigin().x()));
  }
  for (const auto& body : bodies) world.removeRigidBody(body.get());
  world.removeRigidBody(&ground);
}
