/// What the dispatcher remembers of pairs is never believed longer than it is true.
#include "tests/bullet/twin_worlds.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

TwinOptions with_threads(unsigned threads) {
  TwinOptions options;
  options.ours = [threads](btCollisionConfiguration* c) {
    return std::make_unique<CollisionDispatcher>(
        c, DispatcherOptions{.collider = {.backend = Backend::cpu, .threads = threads},
                             .minimum_batch = 0});
  };
  return options;
}

/// Destroys the algorithms of some pairs, whose memory and manifolds go back to Bullet's pools, and
/// lets Bullet make new ones in another order: the same pairs then have the same algorithms by
/// address, with other manifolds.
void remake_algorithms(BulletWorld& w, Random& random) {
  btOverlappingPairCache& cache = *w.world.getPairCache();
  std::vector<std::size_t> chosen;
  const auto n = static_cast<std::size_t>(cache.getNumOverlappingPairs());
  for (std::size_t i = 0; i < n; ++i) {
    if (random.below(3) == 0) chosen.push_back(i);
  }
  btBroadphasePair* pairs = cache.getOverlappingPairArrayPtr();
  for (const std::size_t i : chosen) cache.cleanOverlappingPair(pairs[i], w.dispatcher.get());
  for (std::size_t k = chosen.size(); k > 1; --k) std::swap(chosen[k - 1], chosen[random.below(k)]);
  for (const std::size_t i : chosen) {
    (*w.dispatcher->getNearCallback())(pairs[i], *w.dispatcher, w.world.getDispatchInfo());
  }
}

TEST(PairMirror, NoticesAlgorithmsMadeAnewInTheSamePlace) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Twins twins;
  twins.both([&](BulletWorld& w) { add_heap(w, 80, seed); });
  for (std::uint64_t round = 0; round < 30; ++round) {
    ASSERT_TRUE(twins.step(2));
    twins.both([&](BulletWorld& w) {
      Random random(seed + round);
      remake_algorithms(w, random);
    });
  }
  EXPECT_GT(twins.stats().written, 1000u);
}

TEST(PairMirror, ForgetsAllWhenMostManifoldsGoAtOnce) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Twins twins;
  twins.both([&](BulletWorld& w) { add_heap(w, 500, seed); });
  for (int round = 0; round < 4; ++round) {
    ASSERT_TRUE(twins.step(3));
    ASSERT_GT(twins.ours().dispatcher->getNumManifolds(), 3000)
        << "there must be more than the mirror remembers one by one";
    twins.both([](BulletWorld& w) {
      for (auto& body : w.bodies) w.world.removeRigidBody(body.get());
      std::reverse(w.bodies.begin() + 1, w.bodies.end());
      for (auto& body : w.bodies) w.world.addRigidBody(body.get());
    });
  }
}

TEST(PairMirror, NumbersBodiesAnewWhenMostHaveGone) {
  Twins twins;
  for (int round = 0; round < 8; ++round) {
    // Some hundred new bodies a round take the numbers past what the living ones need.
    twins.both([&](BulletWorld& w) {
      while (w.world.getNumCollisionObjects() > 1) {
        w.world.removeCollisionObject(w.world.getCollisionObjectArray()[1]);
      }
      add_heap(w, 250, static_cast<std::uint64_t>(round), 5);
    });
    ASSERT_TRUE(twins.step(3));
  }
}

TEST(PairMirror, ServesADispatcherThatReleasesInASubclass) {
  /// Its author has forgotten to call the class in between.
  class Careless : public CollisionDispatcher {
   public:
    using CollisionDispatcher::CollisionDispatcher;
    void releaseManifold(btPersistentManifold* manifold) override {
      btCollisionDispatcher::releaseManifold(manifold);
    }
  };
  TwinOptions options;
  options.ours = [](btCollisionConfiguration* c) {
    return std::make_unique<Careless>(c, DispatcherOptions{.minimum_batch = 0});
  };
  Twins twins(options);
  twins.both([](BulletWorld& w) { add_heap(w, 60, 8); });
  for (std::uint64_t round = 0; round < 10; ++round) {
    ASSERT_TRUE(twins.step(2));
    twins.both([&](BulletWorld& w) {
      Random random(round);
      remake_algorithms(w, random);
    });
  }
}

TEST(UnorderedCommit, HasTheSameBitsForAnyNumberOfThreads) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  for (const unsigned threads : {1u, 2u, 5u}) {
    Twins twins(with_threads(threads));
    twins.both([&](BulletWorld& w) { add_heap(w, 700, seed, 6); });
    ASSERT_TRUE(twins.step(10)) << threads;
    EXPECT_GT(twins.ours().world.getPairCache()->getNumOverlappingPairs(), 4096)
        << "more than one thread must have something to do";
    EXPECT_GT(twins.stats().written, 1000u);
  }
}

TEST(UnorderedCommit, ServesSpheresOnBoxesThatTurn) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Twins twins;
  twins.both([&](BulletWorld& w) {
    Random random(seed);
    add_heap(w, 60, seed, 4);
    for (int i = 0; i < 40; ++i) {
      const Vec3 p = random.uniform_in_box({0, 1, 0}, {4, 6, 4});
      const auto edge = [&] { return random.uniform(Real(0.1), Real(0.8)); };
      btRigidBody* box = w.add(w.keep(new btBoxShape(btVector3(edge(), edge(), edge()))),
                               btVector3(p.x, p.y, p.z), i % 4 == 0 ? btScalar(0) : btScalar(1));
      box->setAngularVelocity(btVector3(edge(), edge(), edge()));
      box->setContactStiffnessAndDamping(i % 3 == 0 ? 1000 : BT_LARGE_FLOAT, btScalar(0.1));
    }
  });
  ASSERT_TRUE(twins.step(150));
  EXPECT_GT(twins.stats().sphere_boxes, 1000u);
}

TEST(UnorderedCommit, ServesSpheresBetweenPlanes) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Twins twins;
  twins.both([&](BulletWorld& w) {
    Random random(seed);
    const auto add_plane = [&](const btVector3& normal) {
      return w.add(w.keep(new btStaticPlaneShape(normal.normalized(), 0)), btVector3(0, 0, 0), 0);
    };
    // Some planes come before the spheres of a pair, some behind.
    add_plane(btVector3(0, 1, 0));
    add_plane(btVector3(1, 2, 0))->setContactStiffnessAndDamping(1000, btScalar(0.1));
    for (int i = 0; i < 80; ++i) {
      const Vec3 p = random.uniform_in_box({0, 1, 0}, {4, 6, 4});
      const Real radius = random.uniform(Real(0.2), Real(0.6));
      btRigidBody* body = w.add_sphere(radius, btVector3(p.x, p.y, p.z), i % 9 == 0 ? 0 : 1);
      body->setRollingFriction(btScalar(0.1) * btScalar(i % 3));
      if (i % 7 == 0) body->getCollisionShape()->setMargin(radius / 2);
    }
    add_plane(btVector3(-1, 1, -1));
    // Turned by its body, not by its normal.
    btTransform pose(btQuaternion(btVector3(0, 0, 1), btScalar(-0.4)), btVector3(-4, 0, 0));
    add_plane(btVector3(0, 1, 0))->setWorldTransform(pose);
  });
  ASSERT_TRUE(twins.step(200));
  EXPECT_GT(twins.stats().sphere_planes, 1000u);
}

TEST(UnorderedCommit, LeavesPerturbationToBullet) {
  Twins twins;
  for (BulletWorld* w : {&twins.stock(), &twins.ours()}) {
    auto* configuration = static_cast<btDefaultCollisionConfiguration*>(w->configuration.get());
    configuration->setPlaneConvexMultipointIterations(3, 3);
    configuration->setConvexConvexMultipointIterations(3, 3);
  }
  twins.both([](BulletWorld& w) {
    w.add(w.keep(new btStaticPlaneShape(btVector3(0, 1, 0), 0)), btVector3(0, 0, 0), 0);
    for (int i = 0; i < 6; ++i) {
      const btScalar x = 3 * btScalar(i);
      w.add(w.keep(new btBoxShape(btVector3(1, btScalar(0.5), 1))), btVector3(x, 1, 0));
      w.add_sphere(btScalar(0.5), btVector3(x, btScalar(2.2), 0));
    }
  });
  ASSERT_TRUE(twins.step(60));
  EXPECT_EQ(twins.stats().sphere_planes, 6u * 59u) << "Bullet does not perturb spheres";
  EXPECT_EQ(twins.stats().sphere_boxes, 0u);
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
