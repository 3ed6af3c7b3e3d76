/// The dispatcher's cached pair data is invalidated whenever Bullet's pairs change.
#include "tests/bullet/twin_worlds.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// Destroys the algorithms of some pairs, which returns their memory and manifolds to Bullet's
/// pools, and lets Bullet create new ones in a different order: the pairs then have algorithms at
/// the same addresses, but with other manifolds.
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

TEST(PairTable, DetectsAlgorithmsRecreatedAtTheSameAddress) {
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

TEST(PairTable, IsDiscardedWhenMostManifoldsAreReleasedTogether) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Twins twins;
  twins.both([&](BulletWorld& w) { add_heap(w, 500, seed); });
  for (int round = 0; round < 4; ++round) {
    ASSERT_TRUE(twins.step(3));
    ASSERT_GT(twins.ours().dispatcher->getNumManifolds(), 3000)
        << "there must be more releases than the table records individually";
    twins.both([](BulletWorld& w) {
      for (auto& body : w.bodies) w.world.removeRigidBody(body.get());
      std::reverse(w.bodies.begin() + 1, w.bodies.end());
      for (auto& body : w.bodies) w.world.addRigidBody(body.get());
    });
  }
}

TEST(PairTable, IsRebuiltWhenMostBodiesAreGone) {
  Twins twins;
  for (int round = 0; round < 8; ++round) {
    // A few hundred new bodies per round raise the indices above those of the existing bodies.
    twins.both([&](BulletWorld& w) {
      while (w.world.getNumCollisionObjects() > 1) {
        w.world.removeCollisionObject(w.world.getCollisionObjectArray()[1]);
      }
      add_heap(w, 250, static_cast<std::uint64_t>(round), 5);
    });
    ASSERT_TRUE(twins.step(3));
  }
}

TEST(PairTable, SupportsASubclassThatReleasesManifolds) {
  /// Erroneously skips the release function of its base class.
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

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
