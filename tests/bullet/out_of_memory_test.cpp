/// If any allocation of jfpx fails in a step of a Bullet world, Bullet's own code does that part.
/// No exception propagates through Bullet, and the bits are unchanged.
#include <jfpx/bullet/constraint_solver.hpp>
#include <jfpx/bullet/dynamics_world.hpp>

#include "tests/bullet/twin_worlds.hpp"
#include "tests/support/failing_new.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

using test::FailingNew;
using test::Shortage;
using test::with_every_failure;

constexpr int kStepsAfter = 3;

/// Spheres and boxes on a box, a hinge, a kinematic body: rows of all kinds.
void fill(BulletWorld& w) {
  add_heap(w, 40, 7);
  btRigidBody* a = w.add(w.keep(new btBoxShape(btVector3(1, 1, 1))), btVector3(5, 1, 0));
  btRigidBody* b = w.add(w.keep(new btBoxShape(btVector3(1, 1, 1))), btVector3(7, 1, 0));
  btRigidBody* cart = w.add(w.keep(new btBoxShape(btVector3(1, 1, 1))), btVector3(6, 3, 0), 0);
  cart->setCollisionFlags(cart->getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
  w.world.addConstraint(
      new btPoint2PointConstraint(*a, *b, btVector3(1, 0, 0), btVector3(-1, 0, 0)));
}

void empty(BulletWorld& w) {
  while (w.world.getNumConstraints() > 0) {
    btTypedConstraint* joint = w.world.getConstraint(0);
    w.world.removeConstraint(joint);
    delete joint;
  }
}

/// @returns how many allocations failed
std::size_t expect_that_nothing_shows(const TwinOptions& options) {
  std::uint64_t left_to_bullet = 0;
  bool ours = false;
  const std::size_t failures = with_every_failure([&](std::size_t k, Shortage shortage) {
    Twins twins(options);
    twins.both(fill);
    const auto step = [](BulletWorld& w) { w.world.stepSimulation(btScalar(1) / 60, 0); };
    step(twins.stock());
    EXPECT_NO_THROW({
      const FailingNew failing(k, shortage);
      step(twins.ours());
    }) << k;
    const bool failed = FailingNew::failed();
    const bool same = twins.compare() && twins.step(kStepsAfter);
    EXPECT_TRUE(same) << "allocation " << k;
    if (const CollisionDispatcher* dispatcher = twins.ours().ours()) {
      ours = true;
      const DispatchStats& stats = dispatcher->stats();
      left_to_bullet += stats.fallbacks[static_cast<std::size_t>(Fallback::out_of_memory)];
      EXPECT_EQ(stats.last_fallback, Fallback::none)
          << "allocation " << k << ": disabled permanently";
      EXPECT_EQ(stats.device_failure, "") << "allocation " << k;
    }
    twins.both(empty);
    return failed && !testing::Test::HasFailure();
  });
  EXPECT_EQ(left_to_bullet > 0, ours);
  return failures;
}

WorldParts parts(unsigned threads, bool solver, bool world) {
  WorldParts made;
  if (solver) {
    made.solver = [threads] {
      return std::make_unique<ConstraintSolver>(
          ConstraintSolverOptions{.threads = threads, .minimum_batch = 0});
    };
  }
  if (world) {
    made.world = [threads](btDispatcher* dispatcher, btBroadphaseInterface* broadphase,
                           btConstraintSolver* constraint_solver,
                           btCollisionConfiguration* configuration) {
      return std::make_unique<DynamicsWorld>(dispatcher, broadphase, constraint_solver,
                                             configuration,
                                             DynamicsWorldOptions{.threads = threads});
    };
  }
  return made;
}

TwinOptions stock_dispatcher(WorldParts parts) {
  TwinOptions options;
  options.ours = options.stock;
  options.parts = std::move(parts);
  return options;
}

TEST(OutOfMemoryInBullet, TheDispatcherLeavesTheStepToBullet) {
  EXPECT_GT(expect_that_nothing_shows({}), 10u);
}

TEST(OutOfMemoryInBullet, TheDispatcherInOrderAndInThreadsToo) {
  TwinOptions options;
  options.ours = [](btCollisionConfiguration* c) {
    return std::make_unique<CollisionDispatcher>(
        c, DispatcherOptions{.collider = {.threads = 2}, .minimum_batch = 0, .verify = true});
  };
  options.broadphase = [] { return std::make_unique<btDbvtBroadphase>(); };
  EXPECT_GT(expect_that_nothing_shows(options), 10u);
}

TEST(OutOfMemoryInBullet, TheSolverLeavesTheGroupToBullet) {
  EXPECT_GT(expect_that_nothing_shows(stock_dispatcher(parts(1, true, false))), 5u);
  EXPECT_GT(expect_that_nothing_shows(stock_dispatcher(parts(2, true, false))), 5u);
}

TEST(OutOfMemoryInBullet, TheWorldLeavesTheIslandsToBullet) {
  EXPECT_GT(expect_that_nothing_shows(stock_dispatcher(parts(1, false, true))), 3u);
  EXPECT_GT(expect_that_nothing_shows(stock_dispatcher(parts(2, false, true))), 3u);
}

TEST(OutOfMemoryInBullet, AllPartsTogether) {
  TwinOptions options;
  options.parts = parts(1, true, true);
  EXPECT_GT(expect_that_nothing_shows(options), 20u);
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
