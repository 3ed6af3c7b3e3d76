/// jfpx's algorithm in a stock dispatcher gives the same results as Bullet's.
#include <jfpx/bullet/algorithm.hpp>

#include "tests/bullet/random_world.hpp"

#include <BulletCollision/CollisionShapes/btCompoundShape.h>

#include <limits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

int g_created = 0;

struct CountingCreateFunc final : btCollisionAlgorithmCreateFunc {
  btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                 const btCollisionObjectWrapper* a,
                                                 const btCollisionObjectWrapper* b) override {
    ++g_created;
    return create.CreateCollisionAlgorithm(info, a, b);
  }
  SphereSphereAlgorithm::CreateFunc create;
};

/// A stock dispatcher with the algorithm registered, for contacts and for contact tests.
std::unique_ptr<btCollisionDispatcher> make_with_algorithm(
    btCollisionConfiguration* configuration) {
  static CountingCreateFunc create;
  auto dispatcher = std::make_unique<btCollisionDispatcher>(configuration);
  dispatcher->registerCollisionCreateFunc(SPHERE_SHAPE_PROXYTYPE, SPHERE_SHAPE_PROXYTYPE, &create);
  dispatcher->registerClosestPointsCreateFunc(SPHERE_SHAPE_PROXYTYPE, SPHERE_SHAPE_PROXYTYPE,
                                              &create);
  return dispatcher;
}

class Algorithm : public ::testing::Test {
 protected:
  static TwinOptions options() {
    TwinOptions options;
    options.ours = make_with_algorithm;
    g_created = 0;
    return options;
  }
};

TEST_F(Algorithm, MatchesStockTrajectories) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Twins twins(options());
  twins.both([&](BulletWorld& w) { add_heap(w, 80, seed); });
  ASSERT_TRUE(twins.step(120));
  EXPECT_GT(g_created, 80);
}

TEST_F(Algorithm, SupportsChildrenOfCompoundsInEitherOrder) {
  Twins twins(options());
  twins.both([](BulletWorld& w) {
    w.add(w.keep(new btBoxShape(btVector3(50, 1, 50))), btVector3(0, -1, 0), 0);
    for (int i = 0; i < 24; ++i) {
      const btVector3 at(btScalar(i % 3), btScalar(i) * btScalar(0.4), btScalar(i % 2));
      if (i % 3 == 0) {
        w.add_sphere(btScalar(0.4), at);
        continue;
      }
      auto* compound = new btCompoundShape();
      w.keep(compound);
      btTransform child = btTransform::getIdentity();
      for (int k = -1; k <= 1; ++k) {
        child.setOrigin(btVector3(btScalar(k) * btScalar(0.5), 0, 0));
        compound->addChildShape(child, w.keep(new btSphereShape(btScalar(0.3))));
      }
      w.add(compound, at);
    }
  });
  ASSERT_TRUE(twins.step(120));
  EXPECT_GT(g_created, 24);
}

TEST_F(Algorithm, SupportsContactTestsAtADistance) {
  struct Report : btCollisionWorld::ContactResultCallback {
    btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper* a, int, int,
                             const btCollisionObjectWrapper* b, int, int) override {
      char numbers[128];
      std::snprintf(numbers, sizeof numbers, " %a %a %a", double(point.m_distance1),
                    double(point.m_normalWorldOnB.y()), double(point.m_positionWorldOnA.x()));
      log_event("contact " + name_of(a->getCollisionObject()) + " " +
                name_of(b->getCollisionObject()) + numbers);
      return 0;
    }
  };
  Twins twins(options());
  twins.both([](BulletWorld& w) { add_heap(w, 40, 12); });
  ASSERT_TRUE(twins.step(5));
  std::size_t far = 0;
  twins.both([&](BulletWorld& w) {
    for (std::size_t i = 1; i < 20; ++i) {
      Report report;
      w.world.contactTest(w.bodies[i].get(), report);
      w.world.contactPairTest(w.bodies[i].get(), w.bodies[i + 1].get(), report);
      const std::size_t near = w.log.size();
      report.m_closestDistanceThreshold = 2;
      w.world.contactPairTest(w.bodies[i].get(), w.bodies[i + 20].get(), report);
      far += w.log.size() - near;
    }
  });
  EXPECT_TRUE(twins.compare());
  EXPECT_GT(far, 0u) << "the threshold must reject some pair";
  EXPECT_GT(twins.stock().log.size(), 20u);
}

TEST_F(Algorithm, MatchesStockForSpecialValues) {
  const btScalar kValues[] = {0,
                              std::numeric_limits<btScalar>::denorm_min(),
                              std::numeric_limits<btScalar>::min(),
                              std::numeric_limits<btScalar>::max(),
                              std::numeric_limits<btScalar>::infinity(),
                              std::numeric_limits<btScalar>::quiet_NaN()};
  for (const btScalar value : kValues) {
    Twins twins(options());
    twins.both([&](BulletWorld& w) {
      w.world.setGravity(btVector3(0, 0, 0));
      w.add_sphere(btScalar(0.5), btVector3(0, 0, 0));
      w.add_sphere(btScalar(0.5), btVector3(0, 0, 0));
    });
    ASSERT_TRUE(twins.step(1));
    twins.both([&](BulletWorld& w) {
      btTransform pose = btTransform::getIdentity();
      pose.setOrigin(btVector3(value, 0, value));
      w.bodies[1]->setWorldTransform(pose);
    });
    ASSERT_TRUE(twins.dispatch()) << value;
  }
}

TEST_F(Algorithm, SurvivesAnExhaustedManifoldPool) {
  TwinOptions small = options();
  small.configuration.m_defaultMaxPersistentManifoldPoolSize = 10;
  small.configuration.m_defaultMaxCollisionAlgorithmPoolSize = 16;
  Twins twins(small);
  twins.both([](BulletWorld& w) {
    for (int i = 0; i < 12; ++i) w.add_sphere(1, btVector3(btScalar(i) * btScalar(0.2), 0, 0));
    w.dispatcher->setDispatcherFlags(
        w.dispatcher->getDispatcherFlags() |
        btCollisionDispatcher::CD_DISABLE_CONTACTPOOL_DYNAMIC_ALLOCATION);
  });
  ASSERT_TRUE(twins.step());
  EXPECT_EQ(twins.ours().dispatcher->getNumManifolds(), 10) << "the pool must be exhausted";
  ASSERT_TRUE(twins.step(20));
}

TEST_F(Algorithm, MatchesStockInRandomWorlds) {
  const std::uint64_t seed = test_seed();
  RunTotals totals;
  for (std::uint64_t i = 0; i < 200; ++i) {
    const auto failure = run(make_random_world(seed + i), &totals,
                             [](btCollisionConfiguration* configuration, const RandomWorld&) {
                               return make_with_algorithm(configuration);
                             });
    ASSERT_FALSE(failure) << "JFPX_TEST_SEED=" << seed + i << '\n' << failure->what;
  }
}

TEST_F(Algorithm, DisablesTheBatchesOfOurDispatcher) {
  SphereSphereAlgorithm::CreateFunc create;
  Twins twins;
  twins.both([&](BulletWorld& w) {
    w.dispatcher->registerCollisionCreateFunc(SPHERE_SHAPE_PROXYTYPE, SPHERE_SHAPE_PROXYTYPE,
                                              &create);
    add_heap(w, 30, 13);
  });
  ASSERT_TRUE(twins.step(30));
  EXPECT_EQ(twins.stats().batches, 0u);
  EXPECT_EQ(twins.stats().last_fallback, Fallback::create_function);
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
