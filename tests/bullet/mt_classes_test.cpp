/// Bullet's own multithreaded classes, combined with ours. A library without BT_THREADSAFE runs
/// them on one thread.
#include "tests/bullet/all_parts.hpp"

#include <BulletCollision/CollisionDispatch/btCollisionDispatcherMt.h>
#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorldMt.h>
#include <LinearMath/btThreads.h>

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// Several heaps, which are separate islands, so that a pool has several groups at the same time.
void add_heaps(BulletWorld& w, std::uint64_t seed) {
  w.add(w.keep(new btBoxShape(btVector3(50, 1, 50))), btVector3(0, -1, 0), 0);
  Random random(seed);
  for (int heap = 0; heap < 6; ++heap) {
    const auto x = static_cast<btScalar>(6 * heap - 15);
    for (int i = 0; i < 12 + 12 * heap; ++i) {
      const Vec3 p = random.uniform_in_box({-1, Real(0.4), -1}, {1, 4, 1});
      const btVector3 position(x + p.x, p.y, p.z);
      if (i % 3 == 0) {
        w.add(w.keep(new btBoxShape(btVector3(btScalar(0.3), btScalar(0.2), btScalar(0.3)))),
              position);
      } else {
        w.add_sphere(random.uniform(Real(0.2), Real(0.4)), position);
      }
    }
  }
}

std::unique_ptr<btSequentialImpulseConstraintSolver> make_solver(bool ours, unsigned threads) {
  if (!ours) return std::make_unique<btSequentialImpulseConstraintSolver>();
  return std::make_unique<ConstraintSolver>(
      ConstraintSolverOptions{.backend = Backend::cpu, .threads = threads, .minimum_batch = 0});
}

/// Has its own scheduler of tasks, where Bullet has one.
class MtClasses : public ::testing::Test {
 protected:
  MtClasses() : scheduler_(btCreateDefaultTaskScheduler()) {
    if (scheduler_ != nullptr) scheduler_->setNumThreads(3);
    use_several_threads(true);
  }
  ~MtClasses() override { use_several_threads(false); }

  void use_several_threads(bool several) {
    btSetTaskScheduler(several && scheduler_ != nullptr ? scheduler_.get()
                                                        : btGetSequentialTaskScheduler());
  }
  btConstraintSolverPoolMt* make_pool(bool ours) {
    std::vector<btConstraintSolver*> solvers;
    for (int i = 0; i < 3; ++i) {
      auto solver = make_solver(ours, 1);
      if (ours) our_solvers_.push_back(dynamic_cast<ConstraintSolver*>(solver.get()));
      solvers.push_back(solver.release());
    }
    pools_.push_back(std::make_unique<btConstraintSolverPoolMt>(solvers.data(), 3));
    return pools_.back().get();
  }
  btConstraintSolver* make_large_solver(bool ours) {
    large_solvers_.push_back(make_solver(ours, 2));
    return large_solvers_.back().get();
  }
  /// Groups that our solvers in pools have solved themselves.
  std::uint64_t groups() const {
    std::uint64_t sum = 0;
    for (const ConstraintSolver* solver : our_solvers_) sum += solver->stats().groups;
    return sum;
  }
  void expect_same(BulletWorld& stock, BulletWorld& ours) {
    const std::uint64_t seed = test_seed();
    SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
    add_heaps(stock, seed);
    add_heaps(ours, seed);
    for (std::uint64_t step = 1; step <= 120; ++step) {
      stock.world.stepSimulation(btScalar(1) / 60, 0);
      ours.world.stepSimulation(btScalar(1) / 60, 0);
      const auto difference = first_difference(stock.world, ours.world, step);
      ASSERT_FALSE(difference) << to_text(*difference);
    }
  }

 private:
  std::unique_ptr<btITaskScheduler> scheduler_;
  // These outlive the worlds.
  std::vector<std::unique_ptr<btConstraintSolverPoolMt>> pools_;
  std::vector<std::unique_ptr<btConstraintSolver>> large_solvers_;
  std::vector<ConstraintSolver*> our_solvers_;
};

std::unique_ptr<btBroadphaseInterface> make_tree() { return std::make_unique<btDbvtBroadphase>(); }
std::unique_ptr<btCollisionConfiguration> make_configuration() {
  return std::make_unique<btDefaultCollisionConfiguration>();
}

TEST_F(MtClasses, WorldAndPoolUseOurDispatcherAndSolvers) {
  const auto parts = [&](bool ours) {
    WorldParts made;
    made.world = [this, ours](btDispatcher* dispatcher, btBroadphaseInterface* broadphase,
                              btConstraintSolver*, btCollisionConfiguration* configuration) {
      return std::make_unique<btDiscreteDynamicsWorldMt>(dispatcher, broadphase, make_pool(ours),
                                                         make_large_solver(ours), configuration);
    };
    return made;
  };
  BulletWorld stock(make_configuration(), TwinOptions().stock, make_tree(), parts(false));
  const TwinOptions our_options = all_parts(2, {.minimum_batch = 0});
  BulletWorld ours(make_configuration(), our_options.ours, make_tree(), parts(true));
  expect_same(stock, ours);
  EXPECT_EQ(ours.ours()->stats().batches, 120u);
  EXPECT_GT(groups(), 0u);
}

// On one thread, because several threads of Bullet's dispatcher add manifolds in any order.
TEST_F(MtClasses, DispatcherAndPoolServeOurWorld) {
  use_several_threads(false);
  const BulletWorld::MakeDispatcher dispatcher = [](btCollisionConfiguration* configuration) {
    return std::make_unique<btCollisionDispatcherMt>(configuration);
  };
  WorldParts stock_parts, our_parts;
  stock_parts.world = [this](btDispatcher* d, btBroadphaseInterface* broadphase,
                             btConstraintSolver*, btCollisionConfiguration* configuration) {
    return std::make_unique<btDiscreteDynamicsWorld>(d, broadphase, make_pool(false),
                                                     configuration);
  };
  our_parts.world = [this](btDispatcher* d, btBroadphaseInterface* broadphase, btConstraintSolver*,
                           btCollisionConfiguration* configuration) {
    return std::make_unique<DynamicsWorld>(d, broadphase, make_pool(true), configuration,
                                           DynamicsWorldOptions{.threads = 2});
  };
  BulletWorld stock(make_configuration(), dispatcher, make_tree(), stock_parts);
  BulletWorld ours(make_configuration(), dispatcher, make_tree(), our_parts);
  expect_same(stock, ours);
  EXPECT_GT(groups(), 0u);
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
