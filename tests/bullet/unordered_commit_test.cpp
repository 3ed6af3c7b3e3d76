/// Commits in any order match Bullet for spheres, boxes and planes.
#include "tests/bullet/random_terrain.hpp"
#include "tests/bullet/twin_worlds.hpp"

#include <thread>

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

TEST(UnorderedCommit, HasTheSameBitsForAnyNumberOfThreads) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  for (const unsigned threads : {1u, 2u, 5u}) {
    Twins twins(with_threads(threads));
    twins.both([&](BulletWorld& w) { add_heap(w, 700, seed, 6); });
    ASSERT_TRUE(twins.step(10)) << threads;
    EXPECT_GT(twins.ours().world.getPairCache()->getNumOverlappingPairs(), 4096)
        << "more than one thread must have work";
    EXPECT_GT(twins.stats().written, 1000u);
  }
}

TEST(UnorderedCommit, HandlesSpheresOnRotatingBoxes) {
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

TEST(UnorderedCommit, HandlesSpheresBetweenPlanes) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Twins twins;
  twins.both([&](BulletWorld& w) {
    Random random(seed);
    const auto add_plane = [&](const btVector3& normal) {
      return w.add(w.keep(new btStaticPlaneShape(normal.normalized(), 0)), btVector3(0, 0, 0), 0);
    };
    // Some planes come before the spheres of a pair, some after them.
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
    // Rotated by the pose of its body, not by its normal.
    btTransform pose(btQuaternion(btVector3(0, 0, 1), btScalar(-0.4)), btVector3(-4, 0, 0));
    add_plane(btVector3(0, 1, 0))->setWorldTransform(pose);
  });
  ASSERT_TRUE(twins.step(200));
  EXPECT_GT(twins.stats().sphere_planes, 1000u);
}

/// Convex shapes on a plane and on a static box, some asleep.
void add_convex_heap(BulletWorld& w, int count, std::uint64_t seed) {
  Random random(seed);
  w.add(w.keep(new btStaticPlaneShape(btVector3(0, 1, 0), 0)), btVector3(0, 0, 0), 0);
  w.add(w.keep(new btBoxShape(btVector3(4, 1, 4))), btVector3(0, 0, 0), 0);
  const auto size = [&] { return random.uniform(Real(0.2), Real(0.5)); };
  const std::function<btCollisionShape*()> makers[] = {
      [&] { return new btBoxShape(btVector3(size(), size(), size())); },
      [&] { return new btCapsuleShape(size(), size()); },
      [&] { return new btCapsuleShapeX(size(), size()); },
      [&] { return new btCylinderShapeZ(btVector3(size(), size(), size())); },
      [&] { return new btConeShape(size(), size()); },
      [&] { return make_random_convex(4, random); }, [&] { return make_random_convex(5, random); },
      // Polyhedral features: left to Bullet.
      [&] {
        return random.below(4) == 0 ? make_random_convex(6, random) : new btSphereShape(size());
      },
      [&] { return new btSphereShape(size()); }};
  for (int i = 0; i < count; ++i) {
    // Half of them are boxes.
    const std::size_t kind = random.below(2) == 0 ? 0 : random.below(std::size(makers));
    const Vec3 p = random.uniform_in_box({-3, 1, -3}, {3, 5, 3});
    btRigidBody* body = w.add(w.keep(makers[kind]()), btVector3(p.x, p.y, p.z));
    body->setWorldTransform(
        btTransform(btQuaternion(size(), size(), size()), btVector3(p.x, p.y, p.z)));
    body->setAngularVelocity(btVector3(size(), size(), size()));
    if (i % 11 == 0) body->setActivationState(ISLAND_SLEEPING);
    if (i % 13 == 0) body->setContactStiffnessAndDamping(1000, btScalar(0.1));
    if (i % 17 == 0) body->setIgnoreCollisionCheck(w.bodies[w.bodies.size() - 2].get(), true);
  }
}

TEST(UnorderedCommit, HasBulletsConvexContactsForAnyNumberOfThreads) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  for (const unsigned threads : {1u, 2u, 5u}) {
    Twins twins(with_threads(threads));
    twins.both([&](BulletWorld& w) { add_convex_heap(w, 250, seed); });
    Random random(seed);
    for (int step = 0; step < 40; ++step) {
      const std::size_t i = 2 + random.below(250);
      const Vec3 p = random.uniform_in_box({-3, 1, -3}, {3, 5, 3});
      twins.both([&](BulletWorld& w) {
        w.bodies[i]->getWorldTransform().setOrigin(btVector3(p.x, p.y, p.z));
        if (step % 4 == 0) w.world.removeRigidBody(w.bodies[i].get());
        if (step % 4 == 0) w.world.addRigidBody(w.bodies[i].get());
      });
      ASSERT_TRUE(twins.step()) << threads;
    }
    EXPECT_GT(twins.stats().convex_pairs, 40u * 600u) << "several threads must have work";
  }
}

/// Hulls with polyhedral features are left to Bullet, which counts their tests in global variables.
TEST(UnorderedCommit, TakesHullsWithoutPolyhedralFeaturesAndMultiSpheres) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  constexpr std::uint64_t kHull = 4, kMultiSphere = 5, kPolyhedralHull = 6;
  for (const std::uint64_t kind : {kHull, kMultiSphere, kPolyhedralHull}) {
    Twins twins(with_threads(2));
    twins.both([&](BulletWorld& w) {
      Random random(seed);
      for (int i = 0; i < 60; ++i) {
        const Vec3 p = random.uniform_in_box({-2, 0, -2}, {2, 2, 2});
        w.add(w.keep(make_random_convex(kind, random)), btVector3(p.x, p.y, p.z));
      }
    });
    ASSERT_TRUE(twins.step(30)) << kind;
    EXPECT_EQ(twins.stats().convex_pairs > 1000, kind != kPolyhedralHull) << kind;
    EXPECT_EQ(twins.stats().convex_pairs == 0, kind == kPolyhedralHull) << kind;
  }
}

TEST(UnorderedCommit, RunsWorldsWithoutSpheresOnSeveralThreadsOnly) {
  for (const unsigned threads : {1u, 2u}) {
    Twins twins(with_threads(threads));
    twins.both([](BulletWorld& w) {
      for (int i = 0; i < 9; ++i) {
        w.add(w.keep(new btBoxShape(btVector3(1, 1, 1))), btVector3(0, 2 * btScalar(i), 0),
              i == 0 ? btScalar(0) : btScalar(1));
      }
    });
    ASSERT_TRUE(twins.step(20));
    const bool batched = threads > 1;
    EXPECT_EQ(twins.stats().batches, batched ? 20u : 0u);
    EXPECT_EQ(twins.stats().convex_pairs > 0, batched);
  }
}

/// Remembers the threads that use it.
class UserCapsule final : public btCapsuleShape {
 public:
  using btCapsuleShape::btCapsuleShape;
  btVector3 localGetSupportingVertex(const btVector3& direction) const override {
    only_one_thread_ = only_one_thread_ && std::this_thread::get_id() == thread_;
    return btCapsuleShape::localGetSupportingVertex(direction);
  }
  bool only_one_thread() const { return only_one_thread_; }

 private:
  std::thread::id thread_ = std::this_thread::get_id();
  mutable bool only_one_thread_ = true;
};

TEST(UnorderedCommit, LeavesShapesOfTheUserToTheCallingThread) {
  Twins twins(with_threads(2));
  std::vector<const UserCapsule*> capsules;
  twins.both([&](BulletWorld& w) {
    w.add(w.keep(new btStaticPlaneShape(btVector3(0, 1, 0), 0)), btVector3(0, 0, 0), 0);
    for (int i = 0; i < 600; ++i) {
      const btVector3 at(3 * btScalar(i), btScalar(0.8), 0);
      w.add(w.keep(new btCapsuleShape(btScalar(0.4), btScalar(0.8))), at);
    }
  });
  ASSERT_TRUE(twins.step(3));
  // The pairs keep their algorithms, which are of Bullet's classes.
  twins.both([&](BulletWorld& w) {
    for (std::size_t i = 1; i < w.bodies.size(); ++i) {
      capsules.push_back(new UserCapsule(btScalar(0.4), btScalar(0.8)));
      w.bodies[i]->setCollisionShape(w.keep(const_cast<UserCapsule*>(capsules.back())));
    }
  });
  const std::uint64_t before = twins.stats().convex_pairs;
  EXPECT_GT(before, 0u);
  ASSERT_TRUE(twins.step(20));
  EXPECT_EQ(twins.stats().convex_pairs, before);
  for (const UserCapsule* capsule : capsules) EXPECT_TRUE(capsule->only_one_thread());
}

/// It stores directions in an array that all threads would share.
TEST(UnorderedCommit, LeavesTheMinkowskiDepthSolverToBullet) {
  TwinOptions options = with_threads(2);
  options.configuration.m_useEpaPenetrationAlgorithm = 0;
  Twins twins(options);
  twins.both([](BulletWorld& w) {
    for (int i = 0; i < 100; ++i) {
      const btScalar x = btScalar(0.95) * btScalar(i);
      w.add(w.keep(new btCapsuleShape(btScalar(0.5), 1)), btVector3(x, 0, 0));
      w.add(w.keep(new btBoxShape(btVector3(1, 1, 1))), btVector3(x, 0, 5));
    }
  });
  ASSERT_TRUE(twins.step(5));
  EXPECT_GT(twins.stats().convex_pairs, 0u) << "pairs of boxes do not need it";
  twins.both([](BulletWorld& w) {
    for (std::size_t i = 1; i < w.bodies.size(); i += 2) {
      w.world.removeRigidBody(w.bodies[i].get());
    }
  });
  const std::uint64_t before = twins.stats().convex_pairs;
  ASSERT_TRUE(twins.step(5));
  EXPECT_EQ(twins.stats().convex_pairs, before);
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
