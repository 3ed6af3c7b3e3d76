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

/// Spheres above a plane, two of them with a joint.
class World {
 public:
  explicit World(int spheres) {
    world_.setGravity(btVector3(0, -10, 0));
    bodies_.push_back(new btRigidBody(0, nullptr, &ground_shape_));
    for (int i = 0; i < spheres; ++i) {
      bodies_.push_back(new btRigidBody(1, nullptr, &sphere_shape_, btVector3(1, 1, 1)));
      btTransform pose = btTransform::getIdentity();
      pose.setOrigin(btVector3(btScalar(i % 5) * btScalar(0.9) + btScalar(i) * btScalar(0.001),
                               btScalar(0.4) + btScalar(i / 25) * btScalar(0.9),
                               btScalar(i / 5 % 5) * btScalar(0.9)));
      bodies_.back()->setWorldTransform(pose);
    }
    for (btRigidBody* body : bodies_) world_.addRigidBody(body);
    if (spheres < 2) return;
    joint_ = std::make_unique<btPoint2PointConstraint>(
        *bodies_[1], *bodies_[2], btVector3(btScalar(0.5), 0, 0), btVector3(btScalar(-0.5), 0, 0));
    world_.addConstraint(joint_.get());
  }
  ~World() {
    if (joint_ != nullptr) world_.removeConstraint(joint_.get());
    for (btRigidBody* body : bodies_) {
      world_.removeRigidBody(body);
      delete body;
    }
  }
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  void run() {
    for (int step = 0; step < 60; ++step) {
      // In some steps, rows are solved in random order.
      const int mode = world_.getSolverInfo().m_solverMode & ~SOLVER_RANDMIZE_ORDER;
      world_.getSolverInfo().m_solverMode = step % 20 == 7 ? mode | SOLVER_RANDMIZE_ORDER : mode;
      world_.stepSimulation(btScalar(1) / 60, 0);
      hash_ = hash_of(solver_, hash_);
    }
    for (const btRigidBody* body : bodies_) hash_ = hash_of(*body, hash_);
  }
  std::uint64_t hash() const { return hash_; }

 private:
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
  btStaticPlaneShape ground_shape_{btVector3(0, 1, 0), 0};
  btSphereShape sphere_shape_{btScalar(0.5)};
  std::vector<btRigidBody*> bodies_;
  std::unique_ptr<btPoint2PointConstraint> joint_;
  std::uint64_t hash_ = 0xcbf29ce484222325u;
};

inline std::uint64_t drop(int spheres) {
  World world(spheres);
  world.run();
  return world.hash();
}

}  // namespace stock_world
