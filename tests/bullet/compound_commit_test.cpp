/// Pairs with compounds match btCompoundCompoundCollisionAlgorithm and btCompoundCollisionAlgorithm
/// bit for bit.
#include "tests/bullet/random_terrain.hpp"

#include <BulletCollision/CollisionDispatch/btCompoundCompoundCollisionAlgorithm.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>

#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

btCollisionShape* random_child(Random& random) {
  const auto length = [&] { return random.uniform(Real(0.2), Real(0.6)); };
  switch (random.below(8)) {
    case 0:
      return new btBoxShape(btVector3(length(), length(), length()));
    case 1:
      return new btCapsuleShape(length(), length());
    case 2:
      return new btCylinderShape(btVector3(length(), length(), length()));
    case 3:
      return make_random_convex(random.below(kConvexKinds), random);
    default:
      return new btSphereShape(length());
  }
}

btCompoundShape* random_compound(BulletWorld& w, Random& random) {
  const bool has_tree = random.below(5) != 0;
  auto* compound = new btCompoundShape(has_tree);
  w.keep(compound);
  const std::uint64_t most = random.below(4) == 0 ? 10 : 3;
  const std::uint64_t children = random.below(3) == 0 ? 1 + random.below(most) : 1;
  for (std::uint64_t k = 0; k < children; ++k) {
    const btTransform at =
        random.below(3) == 0 ? btTransform::getIdentity() : random_turned_pose(random, Real(0.4));
    compound->addChildShape(at, w.keep(random_child(random)));
  }
  return compound;
}

/// Equal random compounds, and bodies of other shapes, in two worlds.
class Compounds {
 public:
  Compounds(std::uint64_t seed, unsigned threads, bool verify = false)
      : twins(batch_options(threads, verify)) {
    const bool deterministic = seed % 4 == 0;
    twins.both([&](BulletWorld& w) {
      w.world.getDispatchInfo().m_deterministicOverlappingPairs = deterministic;
      Random random(seed);
      w.add(w.keep(new btBoxShape(btVector3(20, 1, 20))), btVector3(0, -2, 0), 0);
      auto* ground = new btCompoundShape();
      w.keep(ground);
      ground->addChildShape(btTransform::getIdentity(),
                            w.keep(new btStaticPlaneShape(btVector3(0, 1, 0), btScalar(-1))));
      w.add(ground, btVector3(0, 0, 0), 0);
      for (int i = 0; i < kBodies; ++i) {
        btCollisionShape* shape =
            random.below(6) == 0 ? w.keep(random_child(random)) : random_compound(w, random);
        const Vec3 p = random.uniform_in_box({-3, -1, -3}, {3, 2, 3});
        btRigidBody* body = w.add(shape, btVector3(p.x, p.y, p.z));
        body->setFriction(random.uniform(0, 2));
        body->setRestitution(random.uniform(0, 1));
        if (i % 9 == 0) body->setContactStiffnessAndDamping(1000, btScalar(0.1));
        if (i % 10 == 0) body->setIgnoreCollisionCheck(w.bodies[w.bodies.size() / 2].get(), true);
        if (i % 13 == 0) body->setActivationState(DISABLE_SIMULATION);
      }
    });
  }

  void change(Random& random) {
    const std::uint64_t seed = random.below(1u << 30);
    const Real extent = random.below(4) == 0 ? Real(3) : Real(0.03);
    twins.both([&](BulletWorld& w) {
      Random same(seed);
      for (std::size_t i = 2; i < w.bodies.size(); ++i) {
        const btTransform turn = random_turned_pose(same, extent);
        btTransform& pose = w.bodies[i]->getWorldTransform();
        pose.setOrigin(extent > 1 ? turn.getOrigin() : pose.getOrigin() + turn.getOrigin());
        if (extent > 1) pose.setBasis(turn.getBasis());
        if (same.below(40) == 0) change_children(w, *w.bodies[i], same);
      }
      w.world.performDiscreteCollisionDetection();
    });
  }

  Twins twins;

 private:
  static constexpr int kBodies = 40;

  static void change_children(BulletWorld& w, btRigidBody& body, Random& random) {
    if (!body.getCollisionShape()->isCompound()) return;
    auto& compound = static_cast<btCompoundShape&>(*body.getCollisionShape());
    const int last = compound.getNumChildShapes() - 1;
    switch (random.below(4)) {
      case 0:
        compound.addChildShape(random_turned_pose(random, Real(0.4)), w.keep(random_child(random)));
        return;
      case 1:
        // Bullet reads the removed child of a pair that is not cleaned.
        w.world.getBroadphase()->getOverlappingPairCache()->cleanProxyFromPairs(
            body.getBroadphaseHandle(), w.dispatcher.get());
        if (last > 0) compound.removeChildShapeByIndex(last);
        return;
      case 2:
        if (last >= 0) compound.updateChildTransform(last, random_turned_pose(random, Real(0.4)));
        return;
      default:
        if (last >= 0) compound.getChildTransform(last) = random_turned_pose(random, Real(0.4));
    }
  }
};

TEST(CompoundCommit, HasBulletsBitsForRandomCompounds) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  std::uint64_t updated = 0;
  for (std::uint64_t i = 0; i < 24; ++i) {
    Compounds compounds(seed + i, i % 2 == 0 ? 1 : 3);
    Random random(seed + i + 1000);
    for (int k = 0; k < 25; ++k) {
      SCOPED_TRACE("world " + std::to_string(i) + ", change " + std::to_string(k));
      compounds.change(random);
      ASSERT_TRUE(compounds.twins.compare());
    }
    ASSERT_TRUE(compounds.twins.step(10)) << "world " << i;
    updated += compounds.twins.stats().compound_pairs;
  }
  EXPECT_GT(updated, 10'000u);
}

TEST(CompoundCommit, LeavesVerifiedPairsToBullet) {
  Compounds compounds(7, 1, true);
  Random random(8);
  for (int k = 0; k < 10; ++k) {
    compounds.change(random);
    ASSERT_TRUE(compounds.twins.compare());
  }
  EXPECT_EQ(compounds.twins.stats().compound_pairs, 0u);
}

/// A heap of spheres, each the only child of a compound.
void add_wrapped_heap(BulletWorld& w, btCollisionShape* sphere) {
  w.add(w.keep(new btBoxShape(btVector3(50, 1, 50))), btVector3(0, -1, 0), 0);
  auto* compound = new btCompoundShape();
  w.keep(compound);
  compound->addChildShape(btTransform(btQuaternion::getIdentity(), btVector3(0, btScalar(0.1), 0)),
                          sphere);
  Random random(5);
  for (int i = 0; i < 100; ++i) {
    const Vec3 p = random.uniform_in_box({0, Real(0.5), 0}, {3, 4, 3});
    w.add(compound, btVector3(p.x, p.y, p.z));
  }
}

TEST(CompoundCommit, UpdatesSpheresInCompoundsOfOneChild) {
  for (const unsigned threads : {1u, 3u}) {
    Twins twins(batch_options(threads));
    twins.both(
        [](BulletWorld& w) { add_wrapped_heap(w, w.keep(new btSphereShape(btScalar(0.4)))); });
    ASSERT_TRUE(twins.step(90));
    // All but those whose children begin or cease to overlap.
    EXPECT_GT(twins.stats().compound_pairs, twins.stats().pairs / 2);
  }
}

/// A floor of boxes as one compound, as levels and machines are made, with bodies of four classes.
void add_heap_on_many_boxes(BulletWorld& w) {
  auto* floor = new btCompoundShape();
  w.keep(floor);
  auto* tile = w.keep(new btBoxShape(btVector3(1, 1, 1)));
  for (int i = 0; i < 64; ++i) {
    const btVector3 at(btScalar(2 * (i % 8) - 7), -1, btScalar(2 * (i / 8) - 7));
    floor->addChildShape(btTransform(btQuaternion::getIdentity(), at), tile);
  }
  w.add(floor, btVector3(0, 0, 0), 0);
  const btVector3 half(btScalar(0.3), btScalar(0.2), btScalar(0.3));
  btCollisionShape* const shapes[] = {
      w.keep(new btSphereShape(btScalar(0.3))), w.keep(new btBoxShape(half)),
      w.keep(new btCapsuleShape(btScalar(0.2), btScalar(0.3))), w.keep(new btCylinderShape(half))};
  Random random(6);
  for (int i = 0; i < 80; ++i) {
    const Vec3 p = random.uniform_in_box({-6, Real(0.5), -6}, {6, 2, 6});
    w.add(shapes[i % 4], btVector3(p.x, p.y, p.z));
  }
}

TEST(CompoundCommit, UpdatesBodiesOnACompoundOfManyBoxes) {
  for (const unsigned threads : {1u, 3u}) {
    Twins twins(batch_options(threads));
    twins.both([](BulletWorld& w) { add_heap_on_many_boxes(w); });
    ASSERT_TRUE(twins.step(120));
    EXPECT_GT(twins.stats().compound_pairs, 80u * 60u);
  }
}

/// A sphere of a user class, whose functions may only be called as Bullet calls them.
class CountingSphere final : public btSphereShape {
 public:
  using btSphereShape::btSphereShape;
  void getAabb(const btTransform& pose, btVector3& min, btVector3& max) const override {
    ++g_calls;
    btSphereShape::getAabb(pose, min, max);
  }
  inline static std::uint64_t g_calls = 0;
};

TEST(CompoundCommit, LeavesChildrenOfUserClassesToBullet) {
  Twins twins(batch_options(3));
  std::uint64_t calls[2] = {};
  twins.both(
      [](BulletWorld& w) { add_wrapped_heap(w, w.keep(new CountingSphere(btScalar(0.4)))); });
  for (int step = 0; step < 30; ++step) {
    int world = 0;
    twins.both([&](BulletWorld& w) {
      const std::uint64_t before = CountingSphere::g_calls;
      w.world.stepSimulation(btScalar(1) / 60, 0);
      calls[world++] += CountingSphere::g_calls - before;
    });
    ASSERT_TRUE(twins.compare());
  }
  EXPECT_EQ(calls[0], calls[1]);
}

bool log_children(const btCollisionShape* a, const btCollisionShape* b) {
  log_event("children " + std::to_string(a->getShapeType()) + " " +
            std::to_string(b->getShapeType()));
  return b->getUserIndex() != 3;
}

TEST(CompoundCommit, LeavesPairsToBulletWhereTheUserFiltersChildren) {
  Twins twins(batch_options(3));
  gCompoundCompoundChildShapePairCallback = log_children;
  gCompoundChildShapePairCallback = log_children;
  twins.both([](BulletWorld& w) { add_wrapped_heap(w, w.keep(new btSphereShape(btScalar(0.4)))); });
  EXPECT_TRUE(twins.step(20));
  gCompoundCompoundChildShapePairCallback = nullptr;
  gCompoundChildShapePairCallback = nullptr;
  EXPECT_EQ(twins.stats().compound_pairs, 0u);
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
