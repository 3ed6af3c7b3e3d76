/// A Bullet library with BT_THREADSAFE: its solver treats some bodies differently, and the groups
/// with these are left to it. The library is imitated (thread_safe_imitation.cpp).
#include <jfpx/bullet/constraint_solver.hpp>
#include <jfpx/bullet/dynamics_world.hpp>

#include "tests/bullet/twin_worlds.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

TwinOptions all_parts() {
  TwinOptions options;
  options.parts.solver = [] {
    return std::make_unique<ConstraintSolver>(ConstraintSolverOptions{.minimum_batch = 0});
  };
  options.parts.world = [](btDispatcher* dispatcher, btBroadphaseInterface* broadphase,
                           btConstraintSolver* solver, btCollisionConfiguration* configuration) {
    return std::make_unique<DynamicsWorld>(dispatcher, broadphase, solver, configuration);
  };
  return options;
}

const ConstraintSolverStats& solver_stats(Twins& twins) {
  return dynamic_cast<ConstraintSolver&>(*twins.ours().solver).stats();
}
std::uint64_t left_to_bullet(Twins& twins) {
  return solver_stats(twins).fallbacks[static_cast<std::size_t>(SolverFallback::thread_safe)];
}

/// Changes the floor of a heap, which is static and touches every island.
template <class Change>
void change_floor(Twins& twins, const Change& change) {
  twins.both([&](BulletWorld& w) {
    add_heap(w, 60, 17);
    change(*w.bodies[0]);
  });
}

TEST(ThreadSafeLibrary, SolvesGroupsOfDynamicAndStaticBodies) {
  Twins twins(all_parts());
  change_floor(twins, [](btRigidBody&) {});
  ASSERT_TRUE(twins.step(40));
  EXPECT_GT(solver_stats(twins).groups, 30u);
  EXPECT_EQ(left_to_bullet(twins), 0u);
  EXPECT_EQ(twins.stats().batches, 40u);
}

TEST(ThreadSafeLibrary, SolvesGroupsWithKinematicBodies) {
  Twins twins(all_parts());
  change_floor(twins, [](btRigidBody& floor) {
    floor.setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
    floor.setActivationState(DISABLE_DEACTIVATION);
  });
  ASSERT_TRUE(twins.step(40));
  EXPECT_GT(solver_stats(twins).groups, 30u);
  EXPECT_EQ(left_to_bullet(twins), 0u);
}

TEST(ThreadSafeLibrary, IsLeftGroupsWithKinematicBodiesOfFiniteMass) {
  Twins twins(all_parts());
  change_floor(twins, [](btRigidBody& floor) {
    floor.setMassProps(10, btVector3(1, 1, 1));
    floor.setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
    floor.setActivationState(DISABLE_DEACTIVATION);
  });
  ASSERT_TRUE(twins.step(40));
  EXPECT_GT(left_to_bullet(twins), 10u);
  EXPECT_EQ(to_string(SolverFallback::thread_safe), "body with BT_THREADSAFE");
}

TEST(ThreadSafeLibrary, IsLeftGroupsWithStaticBodiesOfFiniteMass) {
  Twins twins(all_parts());
  change_floor(twins, [](btRigidBody& floor) {
    floor.setMassProps(10, btVector3(1, 1, 1));
    floor.setCollisionFlags(btCollisionObject::CF_STATIC_OBJECT);
  });
  ASSERT_TRUE(twins.step(40));
  EXPECT_GT(left_to_bullet(twins), 10u);
}

TEST(ThreadSafeLibrary, IsLeftGroupsWithMovableBodiesOfInfiniteMass) {
  Twins twins(all_parts());
  change_floor(twins, [](btRigidBody& floor) { floor.setCollisionFlags(0); });
  ASSERT_TRUE(twins.step(40));
  EXPECT_GT(left_to_bullet(twins), 10u);
}

TEST(ThreadSafeLibrary, SolvesGroupsWithJointsToKinematicBodies) {
  Twins twins(all_parts());
  std::vector<std::unique_ptr<btTypedConstraint>> joints;
  twins.both([&](BulletWorld& w) {
    add_heap(w, 20, 18);
    btRigidBody* hook = w.add_sphere(btScalar(0.1), btVector3(0, 20, 0), 0);
    hook->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
    hook->setActivationState(DISABLE_DEACTIVATION);
    joints.push_back(std::make_unique<btPoint2PointConstraint>(
        *w.bodies[1], *hook, btVector3(0, 1, 0), btVector3(0, -10, 0)));
    w.world.addConstraint(joints.back().get());
  });
  EXPECT_TRUE(twins.step(40));
  EXPECT_GT(solver_stats(twins).joints, 30u);
  EXPECT_EQ(left_to_bullet(twins), 0u);
  int world = 0;
  twins.both([&](BulletWorld& w) {
    w.world.removeConstraint(joints[static_cast<std::size_t>(world++)].get());
  });
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
