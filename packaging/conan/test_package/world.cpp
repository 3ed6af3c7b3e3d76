/// Drops a sphere in a Bullet world with all parts of jfpx.
#include <jfpx/bullet/constraint_solver.hpp>
#include <jfpx/bullet/dispatcher.hpp>
#include <jfpx/bullet/dynamics_world.hpp>

#include <btBulletDynamicsCommon.h>

#include <cstdio>

int main() {
  btDefaultCollisionConfiguration configuration;
  jfpx::bullet::CollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  jfpx::bullet::ConstraintSolver solver;
  jfpx::bullet::DynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  btSphereShape shape(1);
  btRigidBody ball(1, nullptr, &shape, {1, 1, 1});
  world.addRigidBody(&ball);
  for (int i = 0; i < 10; ++i) world.stepSimulation(btScalar(1) / 60, 0);
  std::printf("the ball fell by %g m\n", -static_cast<double>(ball.getCenterOfMassPosition().y()));
  world.removeRigidBody(&ball);
  return ball.getCenterOfMassPosition().y() < 0 ? 0 : 1;
}
