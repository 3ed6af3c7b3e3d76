/// A Bullet world with all parts of jfpx, with bodies added and removed, does not leak memory.
#include "tests/support/soak.hpp"

#include <jfpx/bullet/constraint_solver.hpp>
#include <jfpx/bullet/dynamics_world.hpp>

#include "tests/bullet/twin_worlds.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

TEST(Soak, ABulletWorldWithAllOurPartsKeepsItsMemoryFlat) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  WorldParts parts;
  parts.solver = [] {
    return std::make_unique<ConstraintSolver>(ConstraintSolverOptions{.minimum_batch = 0});
  };
  parts.world = [](btDispatcher* dispatcher, btBroadphaseInterface* broadphase,
                   btConstraintSolver* solver, btCollisionConfiguration* configuration) {
    return std::make_unique<DynamicsWorld>(dispatcher, broadphase, solver, configuration);
  };
  const TwinOptions options;
  BulletWorld w(std::make_unique<btDefaultCollisionConfiguration>(), options.ours,
                std::make_unique<btDbvtBroadphase>(), parts);
  add_heap(w, 30, seed);
  const btScalar step = btScalar(1) / 60;
  const std::uint64_t steps = test::soak_steps();
  test::expect_flat_memory(steps, [&](std::uint64_t n) {
    if (n % 20 == 0) {
      // A body is removed from the heap and dropped again from above.
      btRigidBody* body = w.bodies[1 + random.below(30)].get();
      w.world.removeRigidBody(body);
      btTransform pose = btTransform::getIdentity();
      const Vec3 p = random.uniform_in_box({0, 3, 0}, {3, 6, 3});
      pose.setOrigin(btVector3(p.x, p.y, p.z));
      body->setWorldTransform(pose);
      body->setInterpolationWorldTransform(pose);
      body->setLinearVelocity(btVector3(0, -5, 0));
      body->activate(true);
      w.world.addRigidBody(body);
    }
    w.world.stepSimulation(step, 0);
  });
  EXPECT_GT(w.ours()->stats().batches, steps * 9 / 10);
  EXPECT_GT(w.ours()->stats().touching, steps / 10);
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
