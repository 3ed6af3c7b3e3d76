/// The constraint solver has the results of Bullet's solver in random and in specific worlds.
#include <jfpx/bullet/constraint_solver.hpp>
#include <jfpx/bullet/dynamics_world.hpp>
#include <jfpx/error.hpp>

#include "tests/bullet/all_parts.hpp"
#include "tests/bullet/joint_without_rtti.hpp"
#include "tests/bullet/stock_bits.hpp"

#include <BulletCollision/CollisionDispatch/btSimulationIslandManager.h>

#include <array>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

TEST(ConstraintSolver, MovesRandomWorldsAsStock) {
  const SolverTotals totals = expect_stocks_bits(wanted_solver_steps(), our_solver, make_stock);
  EXPECT_GT(totals.groups, totals.steps / 4) << "worlds that Bullet solves test nothing";
  EXPECT_GT(totals.contacts, totals.steps);
  EXPECT_GT(totals.joints, totals.steps / 20);
  for (std::size_t i = 0; i < kSolverFallbacks; ++i) {
    RecordProperty("fallbacks_" + std::to_string(i), std::to_string(totals.fallbacks[i]));
  }
}

TEST(DynamicsWorld, MovesRandomWorldsAsStock) {
  expect_stocks_bits(wanted_solver_steps() / 4, our_world, make_stock);
}

TEST(DynamicsWorld, MovesRandomWorldsAsStockWithOurDispatcherAndSolver) {
  expect_stocks_bits(wanted_solver_steps() / 4, our_solver_and_world, make_ours);
}

/// Adds an error of one bit to one velocity.
class SlightlyWrongSolver final : public ConstraintSolver {
 public:
  using ConstraintSolver::ConstraintSolver;
  btScalar solveGroup(btCollisionObject** bodies, int body_count, btPersistentManifold** manifolds,
                      int manifold_count, btTypedConstraint** constraints, int constraint_count,
                      const btContactSolverInfo& info, btIDebugDraw* debug_drawer,
                      btDispatcher* dispatcher) override {
    const std::uint64_t before = stats().contacts;
    const btScalar result =
        ConstraintSolver::solveGroup(bodies, body_count, manifolds, manifold_count, constraints,
                                     constraint_count, info, debug_drawer, dispatcher);
    if (stats().contacts > before) {
      if (btRigidBody* body = btRigidBody::upcast(bodies[body_count - 1])) {
        btVector3 velocity = body->getLinearVelocity();
        velocity.setX(std::nextafter(velocity.x(), btScalar(1e30)));
        body->setLinearVelocity(velocity);
      }
    }
    return result;
  }
  static WorldParts parts(const SolverWorld&) {
    WorldParts made;
    made.solver = [] {
      return std::make_unique<SlightlyWrongSolver>(ConstraintSolverOptions{.minimum_batch = 0});
    };
    return made;
  }
};

TEST(ConstraintSolver, ShowsAnErrorOfOneBitInRandomWorldsAndShrinksThem) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  int failed = 0;
  std::size_t fewest_bodies = std::numeric_limits<std::size_t>::max();
  std::ostringstream shrunk;
  for (std::uint64_t i = 0; i < 40; ++i) {
    const SolverWorld world = make_solver_world(seed + i);
    if (!run(world, nullptr, SlightlyWrongSolver::parts)) continue;
    if (++failed > 3) continue;  // shrinking takes hundreds of runs
    const SolverWorld least = shrink(world, SlightlyWrongSolver::parts);
    EXPECT_TRUE(run(least, nullptr, SlightlyWrongSolver::parts)) << least;
    fewest_bodies = std::min<std::size_t>(fewest_bodies, least.base.used_bodies());
    shrunk << least;
  }
  // A few worlds keep a chain of joints, because without one of them another error occurs first.
  EXPECT_LE(fewest_bodies, 3u) << shrunk.str();
  EXPECT_GT(failed, 10) << "most worlds with contacts must fail";
}

TEST(ConstraintSolver, HasStocksBitsForAnyThreadsVectorsAndModes) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  for (const unsigned threads : {1u, 2u, 3u, 8u}) {
    for (const bool vectors : {true, false}) {
      SolverWorld world = make_large_heap(seed);
      world.threads = threads;
      world.vectors = vectors;
      SolverTotals totals;
      const auto failure = run(world, &totals, our_solver_and_world, make_ours);
      EXPECT_FALSE(failure) << threads << " threads, vectors " << vectors << ": " << failure->what;
      EXPECT_GT(totals.contacts, 12u * 1000u) << "too few contacts for several threads";
    }
  }
}

/// Many contacts, which the solver divides among threads: a layer of balls on a floor.
void add_layer(BulletWorld& w, std::uint64_t seed,
               std::vector<std::unique_ptr<btTypedConstraint>>* joints) {
  Random random(seed);
  w.add(w.keep(new btBoxShape(btVector3(100, 1, 100))), btVector3(0, -1, 0), 0);
  btCollisionShape* ball = w.keep(new btSphereShape(btScalar(0.5)));
  constexpr int kRows = 64;
  btRigidBody* before = nullptr;
  for (int i = 0; i < kRows * kRows; ++i) {
    const btVector3 site(btScalar(i % kRows) * btScalar(0.98), btScalar(0.495),
                         btScalar(i / kRows) * btScalar(0.98));
    const Vec3 v = random.uniform_in_box({-1, -1, -1}, {1, 1, 1});
    btRigidBody* const body = w.add(ball, site);
    body->setLinearVelocity(btVector3(v.x, v.y, v.z));
    if (joints == nullptr) continue;
    if (i % 5 == 0) body->setRollingFriction(btScalar(0.1));
    if (i % 7 == 0) body->setLinearFactor(btVector3(1, 1, btScalar(0.5)));
    if (i % 50 == 0) {
      if (before != nullptr) {
        joints->push_back(std::make_unique<btPoint2PointConstraint>(
            *before, *body, btVector3(0, 1, 0), btVector3(0, 1, 0)));
        w.world.addConstraint(joints->back().get());
      }
      before = body;
    }
  }
}

// The layer has few colors with many contacts each. Eight threads are more than most machines of
// tests have cores, so that some of them are late.
TEST(ConstraintSolver, HasStocksBitsForBodiesDividedAmongThreads) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  for (const unsigned threads : {2u, 3u, 8u}) {
    for (const bool has_joints : {false, true}) {
      SCOPED_TRACE(std::to_string(threads) + (has_joints ? " threads, joints" : " threads"));
      TwinOptions options;
      options.parts.solver = [threads] {
        return std::make_unique<ConstraintSolver>(ConstraintSolverOptions{.threads = threads});
      };
      std::vector<std::unique_ptr<btTypedConstraint>> joints;
      Twins twins(options);
      twins.both([&](BulletWorld& w) { add_layer(w, seed, has_joints ? &joints : nullptr); });
      EXPECT_TRUE(twins.step(has_joints ? 6 : 12));
      twins.both([&](BulletWorld& w) {
        while (w.world.getNumConstraints() > 0) w.world.removeConstraint(w.world.getConstraint(0));
      });
    }
  }
}

WorldParts plain_parts() {
  WorldParts parts;
  parts.solver = [] {
    return std::make_unique<ConstraintSolver>(ConstraintSolverOptions{.minimum_batch = 0});
  };
  return parts;
}
const ConstraintSolver& solver_of(BulletWorld& world) {
  return dynamic_cast<const ConstraintSolver&>(*world.solver);
}
std::uint64_t fallbacks(BulletWorld& world, SolverFallback why) {
  return solver_of(world).stats().fallbacks[static_cast<std::size_t>(why)];
}

TEST(ConstraintSolver, LeavesGroupsThatExplodeToBullet) {
  Twins twins({.parts = plain_parts()});
  twins.both([](BulletWorld& w) {
    add_heap(w, 40, 7);
    // A force instead of a velocity: Bullet removes bodies with infinite boxes from the simulation.
    constexpr btScalar kHuge = std::numeric_limits<btScalar>::max();
    for (std::size_t i = 1; i < 4; ++i) {
      w.bodies[i]->setMassProps(btScalar(0.01), btVector3(1, 1, 1));
      w.bodies[i]->applyCentralForce(btVector3(kHuge, -kHuge, kHuge));
    }
  });
  twins.step();
  EXPECT_GT(fallbacks(twins.ours(), SolverFallback::not_finite), 0u);
}

int g_rows_solved = 0;
btScalar counting_row_solver(btSolverBody&, btSolverBody&, const btSolverConstraint&) {
  ++g_rows_solved;
  return 0;
}

TEST(ConstraintSolver, UsesRowSolversOfTheUser) {
  Twins twins({.parts = plain_parts()});
  twins.both([](BulletWorld& w) { add_heap(w, 30, 3); });
  ASSERT_TRUE(twins.step());
  EXPECT_GT(solver_of(twins.ours()).stats().groups, 0u);
  twins.both(
      [](BulletWorld& w) { w.solver->setConstraintRowSolverLowerLimit(counting_row_solver); });
  g_rows_solved = 0;
  ASSERT_TRUE(twins.step());
  EXPECT_GT(g_rows_solved, 0);
  EXPECT_GT(fallbacks(twins.ours(), SolverFallback::row_solver), 0u);
}

/// A joint that changes velocities itself in every sweep.
struct OwnJoint final : btPoint2PointConstraint {
  using btPoint2PointConstraint::btPoint2PointConstraint;
  int calls = 0;
  void solveConstraintObsolete(btSolverBody& a, btSolverBody&, btScalar) override {
    ++calls;
    a.internalGetDeltaLinearVelocity() += btVector3(0, btScalar(0.01), 0);
  }
};

TEST(ConstraintSolver, LeavesJointsOfUserClassesToBullet) {
  std::vector<std::unique_ptr<OwnJoint>> joints;
  Twins twins({.parts = plain_parts()});
  twins.both([&](BulletWorld& w) {
    add_heap(w, 30, 5);
    joints.push_back(std::make_unique<OwnJoint>(*w.bodies[3], *w.bodies[4], btVector3(0, 1, 0),
                                                btVector3(0, -1, 0)));
    w.world.addConstraint(joints.back().get());
  });
  twins.step(3);
  EXPECT_GT(joints[0]->calls, 0);
  EXPECT_EQ(joints[0]->calls, joints[1]->calls);
  EXPECT_GT(fallbacks(twins.ours(), SolverFallback::constraints), 0u);
  twins.both([&](BulletWorld& w) { w.world.removeConstraint(w.world.getConstraint(0)); });
}

TEST(ConstraintSolver, LeavesJointsWithoutRttiToBullet) {
  std::vector<std::unique_ptr<btTypedConstraint>> joints;
  Twins twins({.parts = plain_parts()});
  twins.both([&](BulletWorld& w) {
    add_heap(w, 30, 5);
    joints.push_back(make_joint_without_rtti(*w.bodies[3], *w.bodies[4]));
    w.world.addConstraint(joints.back().get());
  });
  ASSERT_TRUE(twins.step(3));
  EXPECT_GT(fallbacks(twins.ours(), SolverFallback::constraints), 0u);
  twins.both([&](BulletWorld& w) { w.world.removeConstraint(w.world.getConstraint(0)); });
}

TEST(ConstraintSolver, LeavesSmallGroupsToBullet) {
  Twins twins({.parts = plain_parts()});
  twins.both([](BulletWorld& w) { add_heap(w, 10, 11); });
  auto& solver = dynamic_cast<ConstraintSolver&>(*twins.ours().solver);
  solver.set_minimum_batch(1000);
  EXPECT_EQ(solver.minimum_batch(), 1000u);
  ASSERT_TRUE(twins.step(3));
  EXPECT_EQ(solver.stats().groups, 0u);
  EXPECT_GT(fallbacks(twins.ours(), SolverFallback::small), 0u);
  solver.set_minimum_batch(0);
  ASSERT_TRUE(twins.step(3));
  EXPECT_GT(solver.stats().groups, 0u);
  EXPECT_GT(solver.stats().sweeps, solver.stats().groups);
  solver.reset_stats();
  EXPECT_EQ(solver.stats().groups, 0u);
}

/// Spheres on one movable platform, which every contact shares.
void add_loaded_platform(BulletWorld& w) {
  w.add(w.keep(new btStaticPlaneShape(btVector3(0, 1, 0), 0)), btVector3(0, 0, 0), 0);
  w.add(w.keep(new btBoxShape(btVector3(10, btScalar(0.5), 10))), btVector3(0, btScalar(0.5), 0),
        1000);
  for (int i = 0; i < 50; ++i) {
    w.add_sphere(btScalar(0.5),
                 btVector3(btScalar(i % 8) * 2 - 7, btScalar(1.5), btScalar(i / 8) * 2 - 7));
  }
}

TEST(ConstraintSolver, LeavesGroupsWithLittleParallelismToTheFasterCodeWithTheSameBits) {
  for (const std::size_t minimum : {0u, 1u}) {
    WorldParts parts;
    parts.solver = [minimum] {
      return std::make_unique<ConstraintSolver>(ConstraintSolverOptions{.minimum_batch = minimum});
    };
    Twins twins({.parts = parts});
    twins.both(add_loaded_platform);
    ASSERT_TRUE(twins.step(60));
    const auto& stats = dynamic_cast<ConstraintSolver&>(*twins.ours().solver).stats();
    EXPECT_GT(stats.groups, 0u);
    // Both ways are measured, and so both are used, unless all groups are to be solved by jfpx.
    EXPECT_EQ(fallbacks(twins.ours(), SolverFallback::measured) > 0, minimum > 0);
  }
}

/// All parts of jfpx with three threads, and enough bodies for all of them.
class ThousandsOfBodies : public ::testing::Test {
 protected:
  ThousandsOfBodies() : twins_(all_parts(3)) {
    twins_.both([](BulletWorld& w) {
      Random random(3);
      btCollisionShape* shape = w.keep(new btSphereShape(btScalar(0.5)));
      for (int i = 0; i < 2500; ++i) {
        const Vec3 p = random.uniform_in_box({0, 0, 0}, {15, 15, 15});
        btRigidBody* body = w.add(shape, btVector3(p.x, p.y, p.z), i % 50 == 0 ? 0 : 1);
        body->setDamping(btScalar(0.1), btScalar(0.2));
        body->setAngularVelocity(btVector3(p.x, 1, p.z));
      }
    });
  }
  Twins twins_;
};

TEST_F(ThousandsOfBodies, MoveAsInStockBullet) { ASSERT_TRUE(twins_.step(4)); }

TEST_F(ThousandsOfBodies, MayBeRemovedAndAddedInOneStep) {
  for (std::size_t step = 0; step < 4; ++step) {
    ASSERT_TRUE(twins_.step());
    twins_.both([&](BulletWorld& w) {
      for (std::size_t i = 0; i < 1000; ++i) {
        w.world.removeRigidBody(w.bodies[(7 * i + step) % 2500].get());
      }
      for (std::size_t i = 0; i < 1000; ++i) {
        w.world.addRigidBody(w.bodies[(7 * (999 - i) + step) % 2500].get());
      }
    });
  }
}

TEST(DynamicsWorld, LeavesSmallWorldsToBulletFromAnyStepOn) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  WorldParts parts;
  parts.world = [](btDispatcher* dispatcher, btBroadphaseInterface* broadphase,
                   btConstraintSolver* solver, btCollisionConfiguration* configuration) {
    return std::make_unique<DynamicsWorld>(dispatcher, broadphase, solver, configuration);
  };
  Twins twins({.parts = parts});
  twins.both([&](BulletWorld& w) { add_heap(w, 30, seed); });
  auto& world = dynamic_cast<DynamicsWorld&>(*twins.ours().made_world);
  for (int n = 0; n < 60; ++n) {
    // 30 bodies move. The limit is far below, reached, and not reached.
    const std::size_t minimum = std::array<std::size_t, 3>{0, 30, 31}[random.below(3)];
    world.set_minimum_batch(minimum);
    ASSERT_EQ(world.minimum_batch(), minimum);
    ASSERT_TRUE(twins.step());
  }
}

TEST(ConstraintSolver, AndWorldRefuseTooManyThreads) {
  EXPECT_THROW(ConstraintSolver({.threads = 257}), InvalidArgument);
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  EXPECT_THROW(DynamicsWorld(&dispatcher, &broadphase, nullptr, &configuration, {.threads = 257}),
               InvalidArgument);
}

std::vector<std::pair<int, int>> pairs_of(BulletWorld& world) {
  std::vector<std::pair<int, int>> pairs;
  const btBroadphasePairArray& array = world.world.getPairCache()->getOverlappingPairArray();
  for (int i = 0; i < array.size(); ++i) {
    pairs.emplace_back(array[i].m_pProxy0->getUid(), array[i].m_pProxy1->getUid());
  }
  return pairs;
}

/// Logs every overlap and rejects pairs with an odd sum of ids.
struct LoggingFilter final : btOverlapFilterCallback {
  bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override {
    log_event("filter " + std::to_string(a->getUid()) + " " + std::to_string(b->getUid()));
    return (a->getUid() + b->getUid()) % 2 == 0;
  }
};

TEST(DynamicsWorld, HasStocksPairsInStocksOrder) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  LoggingFilter filter;
  btGhostPairCallback ghosts;
  TwinOptions options;
  options.parts.world = our_world({}).world;
  Twins twins(options);
  twins.both([&](BulletWorld& w) { add_heap(w, 400, seed, 8); });
  std::size_t most = 0;
  const auto expect_same_pairs = [&] {
    ASSERT_TRUE(twins.step());
    const auto pairs = pairs_of(twins.stock());
    most = std::max(most, pairs.size());
    ASSERT_EQ(pairs, pairs_of(twins.ours()));
  };
  for (int step = 0; step < 80; ++step) {
    SCOPED_TRACE(step);
    twins.both([&](BulletWorld& w) {
      if (step == 20) w.world.setForceUpdateAllAabbs(false);
      if (step == 30) w.world.getPairCache()->setInternalGhostPairCallback(&ghosts);
      if (step == 40) w.world.getPairCache()->setOverlapFilterCallback(&filter);
      if (step == 44) w.world.getPairCache()->setOverlapFilterCallback(nullptr);
      // Moves a body far away and back, so that its leaf is removed from the tree and reinserted.
      btRigidBody& body = *w.bodies[static_cast<std::size_t>(1 + step * 5)];
      body.translate(btVector3(step % 2 == 0 ? btScalar(100) : btScalar(0.3), 0, 0));
      if (step % 8 == 7) w.world.removeRigidBody(&body);
    });
    expect_same_pairs();
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(most, 1000u) << "too few pairs for the tables to grow";
}

/// Two worlds of 64 balls that slide on a box, which take the same steps.
class Sliding {
 public:
  explicit Sliding(const WorldParts& stock, const WorldParts& ours)
      : stock_(std::make_unique<btDefaultCollisionConfiguration>(), TwinOptions().stock,
               TwinOptions().broadphase(), stock),
        ours_(std::make_unique<btDefaultCollisionConfiguration>(), TwinOptions().stock,
              TwinOptions().broadphase(), ours) {
    for (BulletWorld* w : {&stock_, &ours_}) {
      w->add(w->keep(new btBoxShape(btVector3(50, 1, 50))), btVector3(0, -1, 0), 0);
      for (int i = 0; i < 64; ++i) {
        const btVector3 position{btScalar(i % 8) - 4, btScalar(0.49), btScalar(i / 8) - 4};
        w->add_sphere(btScalar(0.5), position)->setLinearVelocity(btVector3(1, 0, 0));
      }
    }
  }
  BulletWorld& stock() { return stock_; }
  BulletWorld& ours() { return ours_; }
  void expect_same(int steps) {
    for (int i = 0; i < steps; ++i) {
      for (BulletWorld* w : {&stock_, &ours_}) w->world.stepSimulation(btScalar(1) / 60, 0);
      const auto difference =
          first_difference(stock_.world, ours_.world, static_cast<std::uint64_t>(i));
      ASSERT_FALSE(difference) << to_text(*difference);
    }
  }

 private:
  BulletWorld stock_, ours_;
};

/// A solver of the user, which removes friction and counts the iterations.
template <class Base>
class Slippery final : public Base {
 public:
  int iterations = 0;

 protected:
  void convertContacts(btPersistentManifold** manifolds, int count,
                       const btContactSolverInfo& info) override {
    for (int i = 0; i < count; ++i) {
      for (int k = 0; k < manifolds[i]->getNumContacts(); ++k) {
        manifolds[i]->getContactPoint(k).m_combinedFriction = 0;
      }
    }
    Base::convertContacts(manifolds, count, info);
  }
  btScalar solveSingleIteration(int iteration, btCollisionObject** bodies, int body_count,
                                btPersistentManifold** manifolds, int manifold_count,
                                btTypedConstraint** constraints, int constraint_count,
                                const btContactSolverInfo& info, btIDebugDraw* drawer) override {
    ++iterations;
    return Base::solveSingleIteration(iteration, bodies, body_count, manifolds, manifold_count,
                                      constraints, constraint_count, info, drawer);
  }
};

TEST(ConstraintSolver, LeavesGroupsToASubclassThatOverridesAStep) {
  WorldParts stock, ours;
  stock.solver = [] { return std::make_unique<Slippery<btSequentialImpulseConstraintSolver>>(); };
  ours.solver = [] { return std::make_unique<Slippery<ConstraintSolver>>(); };
  Sliding worlds(stock, ours);
  worlds.expect_same(60);
  const auto& theirs =
      dynamic_cast<Slippery<btSequentialImpulseConstraintSolver>&>(*worlds.stock().solver);
  const auto& mine = dynamic_cast<Slippery<ConstraintSolver>&>(*worlds.ours().solver);
  EXPECT_GT(theirs.iterations, 0);
  EXPECT_EQ(mine.iterations, theirs.iterations);
  EXPECT_EQ(mine.stats().groups, 0u);
  EXPECT_GT(mine.stats().fallbacks[static_cast<std::size_t>(SolverFallback::overridden)], 0u);
}

/// Counts the calls of convertJoints(), including groups without joints.
template <class Base>
class JointCounter final : public Base {
 public:
  int calls = 0;

 protected:
  void convertJoints(btTypedConstraint** joints, int count,
                     const btContactSolverInfo& info) override {
    ++calls;
    Base::convertJoints(joints, count, info);
  }
};

TEST(ConstraintSolver, LeavesGroupsToASubclassThatOverridesConvertJoints) {
  WorldParts stock, ours;
  stock.solver = [] {
    return std::make_unique<JointCounter<btSequentialImpulseConstraintSolver>>();
  };
  ours.solver = [] { return std::make_unique<JointCounter<ConstraintSolver>>(); };
  Sliding worlds(stock, ours);
  worlds.expect_same(5);
  const auto& theirs =
      dynamic_cast<JointCounter<btSequentialImpulseConstraintSolver>&>(*worlds.stock().solver);
  const auto& mine = dynamic_cast<JointCounter<ConstraintSolver>&>(*worlds.ours().solver);
  EXPECT_GT(theirs.calls, 0);
  EXPECT_EQ(mine.calls, theirs.calls);
}

/// Applies no split impulses after soften(). The functions must be set after the first step,
/// because Bullet resets them when the mode changes.
template <class Base>
class Soft final : public Base {
 public:
  void soften() {
    this->m_resolveSplitPenetrationImpulse = [](btSolverBody&, btSolverBody&,
                                                const btSolverConstraint&) { return btScalar(0); };
  }
};

TEST(ConstraintSolver, UsesTheSplitImpulsesOfASubclass) {
  WorldParts stock, ours;
  stock.solver = [] { return std::make_unique<Soft<btSequentialImpulseConstraintSolver>>(); };
  ours.solver = [] { return std::make_unique<Soft<ConstraintSolver>>(); };
  Sliding worlds(stock, ours);
  for (BulletWorld* w : {&worlds.stock(), &worlds.ours()}) {
    w->world.getSolverInfo().m_splitImpulsePenetrationThreshold = 0;  // all overlaps
  }
  worlds.expect_same(1);
  auto& theirs = dynamic_cast<Soft<btSequentialImpulseConstraintSolver>&>(*worlds.stock().solver);
  auto& mine = dynamic_cast<Soft<ConstraintSolver>&>(*worlds.ours().solver);
  theirs.soften();
  mine.soften();
  worlds.expect_same(10);
  EXPECT_GT(mine.stats().fallbacks[static_cast<std::size_t>(SolverFallback::row_solver)], 0u);
}

TEST(ConstraintSolver, LeavesEndlessSweepsToBullet) {
  constexpr int kEndless = 1'000'000'000;
  WorldParts ours;
  ours.solver = our_solver({}).solver;
  for (const bool by_joint : {false, true}) {
    Sliding worlds({}, ours);
    for (BulletWorld* w : {&worlds.stock(), &worlds.ours()}) {
      w->world.getSolverInfo().m_leastSquaresResidualThreshold = btScalar(1e30);
      if (!by_joint) {
        w->world.getSolverInfo().m_numIterations = kEndless;
        continue;
      }
      auto* joint = new btPoint2PointConstraint(*w->bodies[1], btVector3(0, 0, 0));
      joint->setOverrideNumSolverIterations(kEndless);
      w->world.addConstraint(joint);
    }
    worlds.expect_same(3);
    const auto& mine = dynamic_cast<ConstraintSolver&>(*worlds.ours().solver);
    EXPECT_GT(mine.stats().fallbacks[static_cast<std::size_t>(SolverFallback::mode)], 0u);
    for (BulletWorld* w : {&worlds.stock(), &worlds.ours()}) {
      if (!by_joint) continue;
      btTypedConstraint* joint = w->world.getConstraint(0);
      w->world.removeConstraint(joint);
      delete joint;
    }
  }
}

/// Throws once.
struct Throwing final : btSequentialImpulseConstraintSolver {
  btScalar solveGroup(btCollisionObject** bodies, int body_count, btPersistentManifold** manifolds,
                      int manifold_count, btTypedConstraint** constraints, int constraint_count,
                      const btContactSolverInfo& info, btIDebugDraw* drawer,
                      btDispatcher* dispatcher) override {
    if (std::exchange(armed, false)) throw std::runtime_error("enough");
    return btSequentialImpulseConstraintSolver::solveGroup(
        bodies, body_count, manifolds, manifold_count, constraints, constraint_count, info, drawer,
        dispatcher);
  }
  bool armed = false;
};

TEST(DynamicsWorld, DiscardsTheGroupInWhichASolverThrew) {
  WorldParts stock, ours;
  stock.solver = ours.solver = [] { return std::make_unique<Throwing>(); };
  ours.world = our_world({}).world;
  Sliding worlds(stock, ours);
  for (BulletWorld* w : {&worlds.stock(), &worlds.ours()}) {
    // One group that is solved at the end: otherwise Bullet itself would keep removed bodies.
    w->world.getSolverInfo().m_minimumSolverBatchSize = 1 << 20;
  }
  worlds.expect_same(5);
  for (BulletWorld* w : {&worlds.stock(), &worlds.ours()}) {
    dynamic_cast<Throwing&>(*w->solver).armed = true;
    EXPECT_THROW(w->world.stepSimulation(btScalar(1) / 60, 0), std::runtime_error);
    w->world.removeRigidBody(w->bodies.back().get());
    w->bodies.pop_back();
  }
  worlds.expect_same(10);
}

struct CountingManager final : btSimulationIslandManager {
  void storeIslandActivationState(btCollisionWorld* world) override {
    ++stored;
    btSimulationIslandManager::storeIslandActivationState(world);
  }
  int stored = 0;
};
/// A world with an island manager of its own, like Bullet's worlds of multi-bodies.
template <class Base>
class WithManager final : public Base {
 public:
  template <class... Arguments>
  explicit WithManager(Arguments... arguments)
      : Base(arguments...), bullets_(this->m_islandManager) {
    this->m_islandManager = &manager;
  }
  ~WithManager() override { this->m_islandManager = bullets_; }
  CountingManager manager;

 private:
  btSimulationIslandManager* bullets_;
};

TEST(DynamicsWorld, LeavesIslandsToAManagerOfTheUser) {
  WorldParts stock, ours;
  stock.world = [](auto*... parts) {
    return std::make_unique<WithManager<btDiscreteDynamicsWorld>>(parts...);
  };
  ours.world = [](auto*... parts) {
    return std::make_unique<WithManager<DynamicsWorld>>(parts...);
  };
  Sliding worlds(stock, ours);
  worlds.expect_same(5);
  EXPECT_EQ(dynamic_cast<WithManager<DynamicsWorld>&>(worlds.ours().world).manager.stored, 5);
  EXPECT_EQ(
      dynamic_cast<WithManager<btDiscreteDynamicsWorld>&>(worlds.stock().world).manager.stored, 5);
}

/// Adds a ball when the first pair is added while it is armed.
struct Spawner final : btOverlappingPairCallback {
  explicit Spawner(BulletWorld* w) : world(w) {}
  btBroadphasePair* addOverlappingPair(btBroadphaseProxy*, btBroadphaseProxy*) override {
    if (std::exchange(armed, false)) {
      world->add_sphere(btScalar(0.5), btVector3(0, btScalar(1.2), 0));
      ++spawned;
    }
    return nullptr;
  }
  void* removeOverlappingPair(btBroadphaseProxy*, btBroadphaseProxy*, btDispatcher*) override {
    return nullptr;
  }
  void removeOverlappingPairsContainingProxy(btBroadphaseProxy*, btDispatcher*) override {}
  BulletWorld* world;
  bool armed = true;
  int spawned = 0;
};

TEST(DynamicsWorld, HasStocksPairsWhenACallbackAddsBodies) {
  WorldParts ours;
  ours.world = our_world({}).world;
  Sliding worlds({}, ours);
  worlds.expect_same(1);
  Spawner stock_spawner(&worlds.stock()), our_spawner(&worlds.ours());
  worlds.stock().world.getPairCache()->setInternalGhostPairCallback(&stock_spawner);
  worlds.ours().world.getPairCache()->setInternalGhostPairCallback(&our_spawner);
  for (BulletWorld* w : {&worlds.stock(), &worlds.ours()}) {
    w->bodies[20]->translate(btVector3(3, btScalar(0.6), 2));
  }
  worlds.expect_same(1);
  EXPECT_EQ(stock_spawner.spawned, 1);
  EXPECT_EQ(our_spawner.spawned, 1);
  EXPECT_EQ(pairs_of(worlds.stock()), pairs_of(worlds.ours()));
  worlds.expect_same(30);
  worlds.stock().world.getPairCache()->setInternalGhostPairCallback(nullptr);
  worlds.ours().world.getPairCache()->setInternalGhostPairCallback(nullptr);
}

/// Removes the body about which Bullet reports a warning, which happens once per process.
class Remover final : public btIDebugDraw {
 public:
  explicit Remover(BulletWorld* w) : world_(w) {}
  void drawLine(const btVector3&, const btVector3&, const btVector3&) override {}
  void drawContactPoint(const btVector3&, const btVector3&, btScalar, int,
                        const btVector3&) override {}
  void draw3dText(const btVector3&, const char*) override {}
  void setDebugMode(int) override {}
  int getDebugMode() const override { return 0; }
  void reportErrorWarning(const char*) override {
    for (const auto& body : world_->bodies) {
      if (body->isInWorld() && body->getActivationState() == DISABLE_SIMULATION) {
        world_->world.removeRigidBody(body.get());
      }
    }
    ++reports;
  }
  int reports = 0;

 private:
  BulletWorld* world_;
};

TEST(DynamicsWorld, AllowsADebugDrawerToRemoveBodies) {
  WorldParts ours;
  ours.world = our_world({}).world;
  Sliding worlds({}, ours);
  Remover remover(&worlds.ours());
  worlds.ours().world.setDebugDrawer(&remover);
  worlds.ours().bodies[7]->setLinearVelocity(btVector3(0, btScalar(1e9), 0));
  for (int i = 0; i < 5; ++i) worlds.ours().world.stepSimulation(btScalar(1) / 60, 0);
  EXPECT_GT(remover.reports, 0) << "has this process reported a warning before?";
  EXPECT_FALSE(worlds.ours().bodies[7]->isInWorld());
  worlds.ours().world.setDebugDrawer(nullptr);
}

/// Logs the poses that it receives; moves a kinematic body.
class LoggingMotionState final : public btMotionState {
 public:
  explicit LoggingMotionState(int number) : number_(number) {}
  void getWorldTransform(btTransform& pose) const override {
    pose.setIdentity();
    pose.setOrigin(btVector3(btScalar(asked_++) / 64, btScalar(0.49), -5));
  }
  void setWorldTransform(const btTransform& pose) override {
    std::ostringstream text;
    text << std::hexfloat << number_ << ": " << pose.getOrigin().x() << ' ' << pose.getOrigin().y();
    log_event(text.str());
  }

 private:
  int number_;
  mutable int asked_ = 0;
};

TEST(DynamicsWorld, CallsMotionStatesAsStockDoes) {
  Twins twins({.parts = {.world = our_world({}).world}});
  std::vector<std::unique_ptr<LoggingMotionState>> states;
  twins.both([&](BulletWorld& w) {
    w.world.setSynchronizeAllMotionStates(false);
    add_heap(w, 60, 5);
    for (int i = 1; i <= 20; ++i) {
      states.push_back(std::make_unique<LoggingMotionState>(i));
      w.bodies[static_cast<std::size_t>(i)]->setMotionState(states.back().get());
    }
    btRigidBody* pusher = w.bodies[20].get();
    w.world.removeRigidBody(pusher);
    pusher->setCollisionFlags(pusher->getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
    pusher->setActivationState(DISABLE_DEACTIVATION);
    w.world.addRigidBody(pusher);
  });
  for (int step = 0; step < 60; ++step) {
    twins.both([&](BulletWorld& w) {
      if (step == 20) w.world.setSynchronizeAllMotionStates(true);
      if (step == 30) w.world.setLatencyMotionStateInterpolation(false);
      if (step == 40) w.bodies[3]->forceActivationState(ISLAND_SLEEPING);
      w.bodies[5]->applyCentralForce(btVector3(0, 3, 0));
      w.world.stepSimulation(btScalar(1) / 60, 3, btScalar(1) / 100);
    });
    ASSERT_TRUE(twins.compare()) << "step " << step;
  }
  EXPECT_GT(twins.ours().log.size(), 500u);
}

TEST(DynamicsWorld, OwnsADefaultSolver) {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  DynamicsWorld world(&dispatcher, &broadphase, nullptr, &configuration);
  world.stepSimulation(btScalar(1) / 60, 0);
  EXPECT_NE(world.getConstraintSolver(), nullptr);
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
