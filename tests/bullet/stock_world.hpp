/// A world of Bullet without jfpx, in which spheres fall, and a hash of its results.
#pragma once

#include <btBulletDynamicsCommon.h>

#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

namespace stock_world {

template <class Value>
std::uint64_t hash_of(const Value& value, std::uint64_t hash) {
  unsigned char bytes[sizeof(Value)];
  std::memcpy(bytes, &value, sizeof bytes);
  for (const unsigned char byte : bytes) hash = (hash ^ byte) * 0x100000001b3u;  // FNV-1a
  return hash;
}
inline std::uint64_t hash_of(const btRigidBody& body, std::uint64_t hash) {
  for (int i = 0; i < 3; ++i) hash = hash_of(body.getWorldTransform().getOrigin()[i], hash);
  return hash;
}
/// The statistics and the state of a solver.
inline std::uint64_t hash_of(const btSequentialImpulseConstraintSolver& solver,
                             std::uint64_t hash) {
  const btSolverAnalyticsData& data = solver.m_analyticsData;
  hash = hash_of(data.m_numSolverCalls, hash_of(data.m_numIterationsUsed, hash));
  return hash_of(solver.getRandSeed(), hash_of(data.m_remainingLeastSquaresResidual, hash));
}

inline std::uint64_t drop(int spheres) {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  world.setGravity(btVector3(0, -10, 0));
  btStaticPlaneShape ground_shape(btVector3(0, 1, 0), 0);
  btSphereShape sphere_shape(btScalar(0.5));
  std::vector<btRigidBody*> bodies;
  bodies.push_back(new btRigidBody(0, nullptr, &ground_shape));
  for (int i = 0; i < spheres; ++i) {
    bodies.push_back(new btRigidBody(1, nullptr, &sphere_shape, btVector3(1, 1, 1)));
    btTransform pose = btTransform::getIdentity();
    pose.setOrigin(btVector3(btScalar(i % 5) * btScalar(0.9) + btScalar(i) * btScalar(0.001),
                             btScalar(0.4) + btScalar(i / 25) * btScalar(0.9),
                             btScalar(i / 5 % 5) * btScalar(0.9)));
    bodies.back()->setWorldTransform(pose);
  }
  for (btRigidBody* body : bodies) world.addRigidBody(body);
  std::unique_ptr<btPoint2PointConstraint> joint;
  if (spheres > 1) {
    joint = std::make_unique<btPoint2PointConstraint>(
        *bodies[1], *bodies[2], btVector3(btScalar(0.5), 0, 0), btVector3(btScalar(-0.5), 0, 0));
    world.addConstraint(joint.get());
  }
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (int step = 0; step < 60; ++step) {
    // In some steps, rows are solved in random order.
    const int mode = world.getSolverInfo().m_solverMode & ~SOLVER_RANDMIZE_ORDER;
    world.getSolverInfo().m_solverMode = step % 20 == 7 ? mode | SOLVER_RANDMIZE_ORDER : mode;
    world.stepSimulation(btScalar(1) / 60, 0);
    hash = hash_of(solver, hash);
  }
  if (joint != nullptr) world.removeConstraint(joint.get());
  for (btRigidBody* body : bodies) {
    hash = hash_of(*body, hash);
    world.removeRigidBody(body);
    delete body;
  }
  return hash;
}

}  // namespace stock_world
