/// A typical Bullet program with the three classes of jfpx, each of which is optional.
#include <jfpx/bullet/constraint_solver.hpp>
#include <jfpx/bullet/dispatcher.hpp>
#include <jfpx/bullet/dynamics_world.hpp>

#include <btBulletDynamicsCommon.h>

#include <cstdio>
#include <memory>
#include <vector>

int main() {
  btDefaultCollisionConfiguration configuration;
  jfpx::bullet::CollisionDispatcher dispatcher(&configuration);  // was: btCollisionDispatcher
  btDbvtBroadphase broadphase;
  jfpx::bullet::ConstraintSolver solver;  // was: btSequentialImpulseConstraintSolver
  jfpx::bullet::DynamicsWorld world(&dispatcher, &broadphase, &solver,
                                    &configuration);  // was: btDiscreteDynamicsWorld
  world.setGravity(btVector3(0, -10, 0));

  btBoxShape ground_shape(btVector3(50, 50, 50));
  btSphereShape sphere_shape(btScalar(0.5));
  btVector3 inertia;
  sphere_shape.calculateLocalInertia(1, inertia);
  std::vector<std::unique_ptr<btRigidBody>> bodies;
  bodies.push_back(std::make_unique<btRigidBody>(0, nullptr, &ground_shape));
  bodies.back()->getWorldTransform().setOrigin(btVector3(0, -50, 0));
  for (int i = 0; i < 1000; ++i) {
    bodies.push_back(std::make_unique<btRigidBody>(1, nullptr, &sphere_shape, inertia));
    // Ten layers of ten by ten spheres, slightly tilted so that they fall over.
    const int column = i % 10, row = i / 10 % 10, layer = i / 100;
    const btVector3 cell{btScalar(column), btScalar(layer), btScalar(row)};
    bodies.back()->getWorldTransform().setOrigin(
        cell * btScalar(0.95) + btVector3(cell.y() * btScalar(0.1), btScalar(0.5), 0));
  }
  for (const auto& body : bodies) world.addRigidBody(body.get());

  for (int step = 0; step < 120; ++step) world.stepSimulation(btScalar(1) / 60, 1);

  const btVector3& top = bodies.back()->getWorldTransform().getOrigin();
  std::printf("the last sphere is at (%.9g, %.9g, %.9g)\n", double(top.x()), double(top.y()),
              double(top.z()));
  const jfpx::bullet::DispatchStats& stats = dispatcher.stats();
  std::printf("%llu of %llu dispatches in batches; %llu contacts of spheres\n",
              static_cast<unsigned long long>(stats.batches),
              static_cast<unsigned long long>(stats.dispatches),
              static_cast<unsigned long long>(stats.touching));
  std::printf("%llu contacts solved by jfpx\n",
              static_cast<unsigned long long>(solver.stats().contacts));
  for (const auto& body : bodies) world.removeRigidBody(body.get());
}
