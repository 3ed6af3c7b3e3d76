/// Islands of large collision worlds are those of Bullet's island manager, label by label.
#include "src/bullet/world/islands.hpp"

#include "tests/bullet/twin_worlds.hpp"

#include <BulletCollision/CollisionDispatch/btSimulationIslandManager.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// Random spheres of which some are static, kinematic or sensors.
struct Cloud {
  Cloud(Random random, int count, Real edge) {
    for (int i = 0; i < count; ++i) {
      objects.push_back(std::make_unique<btCollisionObject>());
      btCollisionObject& object = *objects.back();
      object.setCollisionShape(&shape);
      object.getWorldTransform().setIdentity();
      object.getWorldTransform().setOrigin(
          btVector3(random.uniform(0, edge), random.uniform(0, edge), random.uniform(0, edge)));
      constexpr int kFlags[] = {btCollisionObject::CF_STATIC_OBJECT,
                                btCollisionObject::CF_KINEMATIC_OBJECT,
                                btCollisionObject::CF_NO_CONTACT_RESPONSE};
      const std::uint64_t kind = random.below(30);
      object.setCollisionFlags(kind < 3 ? kFlags[kind] : 0);
      world.addCollisionObject(&object);
    }
    world.performDiscreteCollisionDetection();
  }
  ~Cloud() {
    for (const auto& object : objects) world.removeCollisionObject(object.get());
  }

  btSphereShape shape{btScalar(0.5)};
  std::vector<std::unique_ptr<btCollisionObject>> objects;
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btCollisionWorld world{&dispatcher, &broadphase, &configuration};
};

TEST(Islands, HaveStocksLabelsInLargeWorlds) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  // From one large island to many small ones.
  for (const Real edge : {Real(9), Real(16), Real(22), Real(40)}) {
    Cloud stock(Random(seed), 4000, edge), ours(Random(seed), 4000, edge);
    btSimulationIslandManager manager;
    manager.updateActivationState(&stock.world, &stock.dispatcher);
    manager.storeIslandActivationState(&stock.world);
    for (const unsigned threads : {1u, 3u}) {
      for (const std::size_t round : {std::size_t{60}, std::size_t{700}, std::size_t{1} << 17}) {
        ThreadPool pool(threads);
        IslandSolver islands(pool, round);
        btUnionFind unions;
        ASSERT_TRUE(islands.reserve_for_unions(ours.world));
        islands.number_and_unite(ours.world, &unions);
        islands.store_islands(ours.world, &unions);
        for (std::size_t i = 0; i < stock.objects.size(); ++i) {
          const btCollisionObject &s = *stock.objects[i], &o = *ours.objects[i];
          ASSERT_EQ(s.getIslandTag(), o.getIslandTag()) << "object " << i << ", round " << round;
          ASSERT_EQ(s.getCompanionId(), o.getCompanionId());
          ASSERT_EQ(s.getHitFraction(), o.getHitFraction());
        }
        ASSERT_EQ(manager.getUnionFind().getNumElements(), unions.getNumElements());
        for (int i = 0; i < unions.getNumElements(); ++i) {
          ASSERT_EQ(manager.getUnionFind().find(i), unions.find(i));
          ASSERT_EQ(manager.getUnionFind().getElement(i).m_sz, unions.getElement(i).m_sz);
        }
      }
    }
  }
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
