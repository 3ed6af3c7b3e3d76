/// A Bullet world of ragdolls, with stock Bullet's parts or with those of jfpx.
#pragma once

#include <jfpx/body.hpp>
#include <jfpx/bullet/constraint_solver.hpp>
#include <jfpx/bullet/dispatcher.hpp>
#include <jfpx/bullet/dynamics_world.hpp>

#include <btBulletDynamicsCommon.h>

#include <memory>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Ragdolls in the manner of Bullet's RagdollDemo, 11 capsules and 10 joints each, that fall in
/// layers onto a plane. Nothing sleeps.
class RagdollWorld {
 public:
  /// @param threads of the parts of jfpx; 0: stock Bullet
  RagdollWorld(int ragdolls, unsigned threads) {
    if (threads == 0) {
      dispatcher_ = std::make_unique<btCollisionDispatcher>(&configuration_);
      solver_ = std::make_unique<btSequentialImpulseConstraintSolver>();
      world_ = std::make_unique<btDiscreteDynamicsWorld>(dispatcher_.get(), &broadphase_,
                                                         solver_.get(), &configuration_);
    } else {
      dispatcher_ = std::make_unique<CollisionDispatcher>(
          &configuration_, DispatcherOptions{.collider = {.threads = threads}});
      solver_ = std::make_unique<ConstraintSolver>(ConstraintSolverOptions{.threads = threads});
      world_ = std::make_unique<DynamicsWorld>(dispatcher_.get(), &broadphase_, solver_.get(),
                                               &configuration_,
                                               DynamicsWorldOptions{.threads = threads});
    }
    add(&ground_, 0, btTransform::getIdentity());
    int side = 1;
    while (side * side * 4 < ragdolls) ++side;
    for (int i = 0; i < ragdolls; ++i) {
      const int layer = i / (side * side), column = i % (side * side);
      add_ragdoll(btVector3(btScalar(1.2) * btScalar(column % side) + btScalar(0.3 * layer),
                            btScalar(2.2) * btScalar(layer),
                            btScalar(0.8) * btScalar(column / side)));
    }
  }
  ~RagdollWorld() {
    for (const auto& joint : joints_) world_->removeConstraint(joint.get());
    for (const auto& body : bodies_) world_->removeRigidBody(body.get());
  }
  RagdollWorld(const RagdollWorld&) = delete;
  RagdollWorld& operator=(const RagdollWorld&) = delete;

  void step() { world_->stepSimulation(btScalar(1) / 60, 0); }
  std::uint64_t state_hash() const {
    std::vector<BodyState> states;
    for (const auto& body : bodies_) {
      const btVector3 &at = body->getWorldTransform().getOrigin(), &v = body->getLinearVelocity();
      const btVector3& spin = body->getAngularVelocity();
      btQuaternion turn = body->getWorldTransform().getRotation();
      states.push_back({.position = {at.x(), at.y(), at.z()},
                        .orientation = {turn.w(), turn.x(), turn.y(), turn.z()},
                        .velocity = {v.x(), v.y(), v.z()},
                        .angular_velocity = {spin.x(), spin.y(), spin.z()}});
    }
    return jfpx::state_hash(states);
  }
  const btDiscreteDynamicsWorld& world() const { return *world_; }

 private:
  btRigidBody* add(btCollisionShape* shape, btScalar mass, const btTransform& pose) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape->calculateLocalInertia(mass, inertia);
    btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, shape, inertia);
    info.m_startWorldTransform = pose;
    info.m_linearDamping = btScalar(0.05);
    info.m_angularDamping = btScalar(0.85);
    bodies_.push_back(std::make_unique<btRigidBody>(info));
    bodies_.back()->setActivationState(DISABLE_DEACTIVATION);
    world_->addRigidBody(bodies_.back().get());
    return bodies_.back().get();
  }

  /// Joins two bodies at a point; the frames of the joint are turned about the z axis.
  template <class Joint>
  Joint* join(btRigidBody* a, btRigidBody* b, const btVector3& at, btScalar angle) {
    const btTransform frame(btQuaternion(btVector3(0, 0, 1), angle), at);
    auto joint = std::make_unique<Joint>(*a, *b, a->getWorldTransform().inverse() * frame,
                                         b->getWorldTransform().inverse() * frame);
    Joint* const made = joint.get();
    joints_.push_back(std::move(joint));
    world_->addConstraint(made, true);
    return made;
  }
  void hinge(btRigidBody* a, btRigidBody* b, const btVector3& at) {
    join<btHingeConstraint>(a, b, at, 0)->setLimit(0, SIMD_HALF_PI);
  }
  void cone(btRigidBody* a, btRigidBody* b, const btVector3& at, btScalar angle) {
    join<btConeTwistConstraint>(a, b, at, angle)->setLimit(SIMD_PI / 4, SIMD_PI / 4, 0);
  }

  void add_ragdoll(const btVector3& at) {
    const auto upright = [&](btCollisionShape* shape, btScalar x, btScalar y) {
      return add(shape, 1, btTransform(btQuaternion::getIdentity(), at + btVector3(x, y, 0)));
    };
    const auto along_x = [&](btCollisionShape* shape, btScalar x, btScalar y) {
      const btQuaternion turn(btVector3(0, 0, 1), SIMD_HALF_PI);
      return add(shape, 1, btTransform(turn, at + btVector3(x, y, 0)));
    };
    btRigidBody* pelvis = upright(&pelvis_, 0, 1);
    btRigidBody* spine = upright(&spine_, 0, btScalar(1.2));
    btRigidBody* head = upright(&head_, 0, btScalar(1.6));
    hinge(pelvis, spine, at + btVector3(0, btScalar(1.15), 0));
    cone(spine, head, at + btVector3(0, btScalar(1.5), 0), SIMD_HALF_PI);
    for (const btScalar side : {btScalar(-1), btScalar(1)}) {
      const btScalar hip = side * btScalar(0.18), shoulder = side * btScalar(0.2);
      btRigidBody* thigh = upright(&upper_leg_, hip, btScalar(0.65));
      btRigidBody* shin = upright(&lower_leg_, hip, btScalar(0.2));
      cone(pelvis, thigh, at + btVector3(hip, btScalar(0.9), 0), side * SIMD_PI / 4);
      hinge(thigh, shin, at + btVector3(hip, btScalar(0.42), 0));
      btRigidBody* arm = along_x(&upper_arm_, side * btScalar(0.35), btScalar(1.45));
      btRigidBody* forearm = along_x(&lower_arm_, side * btScalar(0.7), btScalar(1.45));
      cone(spine, arm, at + btVector3(shoulder, btScalar(1.45), 0), 0);
      hinge(arm, forearm, at + btVector3(side * btScalar(0.53), btScalar(1.45), 0));
    }
  }

  static constexpr btScalar kThick = btScalar(0.07), kThin = btScalar(0.05);
  btCapsuleShape pelvis_{btScalar(0.15), btScalar(0.20)}, spine_{btScalar(0.15), btScalar(0.28)};
  btCapsuleShape head_{btScalar(0.10), btScalar(0.05)};
  btCapsuleShape upper_leg_{kThick, btScalar(0.45)}, lower_leg_{kThin, btScalar(0.37)};
  btCapsuleShape upper_arm_{kThin, btScalar(0.33)}, lower_arm_{btScalar(0.04), btScalar(0.25)};
  btStaticPlaneShape ground_{btVector3(0, 1, 0), 0};
  btDefaultCollisionConfiguration configuration_;
  btDbvtBroadphase broadphase_;
  std::unique_ptr<btCollisionDispatcher> dispatcher_;
  std::unique_ptr<btSequentialImpulseConstraintSolver> solver_;
  std::unique_ptr<btDiscreteDynamicsWorld> world_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  std::vector<std::unique_ptr<btTypedConstraint>> joints_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
