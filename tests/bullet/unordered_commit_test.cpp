/// Commits in any order match Bullet for spheres, boxes and planes.
#include "tests/bullet/twin_worlds.hpp"

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
