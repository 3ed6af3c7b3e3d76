/// A Bullet world with our dispatcher moves bit for bit like a stock one.
#include <jfpx/bullet/scene_world.hpp>
#include <jfpx/bullet/verify.hpp>

#include "src/scenes/scenes.hpp"
#include "tests/bullet/twin_worlds.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

struct Case {
  const char* scene;
  std::uint32_t spheres;
  int steps;
};

class Trajectory : public ::testing::TestWithParam<Case> {
 protected:
  /// Steps the scene with both dispatchers; every contact is also compared with find_contacts.
  void expect_identical(const SceneWorldOptions& options, bool sleep) {
    const std::uint64_t seed = test_seed();
    SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
    Scene scene = scenes::make(GetParam().scene, {.spheres = GetParam().spheres, .seed = seed});
    scene.sleep.enabled = sleep;
    for (BodyDef& body : scene.bodies) body.can_sleep = true;

    SceneWorldOptions stock_options = options;
    stock_options.dispatcher = DispatcherKind::stock;
    SceneWorld stock(scene, stock_options);
    SceneWorld ours(scene, options);
    ContactCheck check;
    for (int step = 1; step <= GetParam().steps; ++step) {
      check.capture(stock.world());
      stock.step();
      ours.step();
      check.compare(stock.world(), static_cast<std::uint64_t>(step));
      const auto difference =
          first_difference(stock.world(), ours.world(), static_cast<std::uint64_t>(step));
      ASSERT_FALSE(difference) << to_text(*difference);
      ASSERT_EQ(check.mismatches(), 0u) << to_text(*check.first());
    }
    EXPECT_EQ(stock.state_hash(), ours.state_hash());
    EXPECT_GT(check.compared(), 0u);
    if (options.dispatch.minimum_batch == 0) {
      EXPECT_GT(ours.jfpx_dispatcher()->stats().batches, 0u);
    }
  }
};

TEST_P(Trajectory, MatchesStockWithEveryPairBatched) {
  SceneWorldOptions options;
  options.dispatch.minimum_batch = 0;
  expect_identical(options, false);
}

TEST_P(Trajectory, MatchesStockWithSleepAndDefaults) { expect_identical({}, true); }

TEST_P(Trajectory, MatchesStockWithSortedPairs) {
  SceneWorldOptions options;
  options.dispatch.minimum_batch = 0;
  options.deterministic_pairs = true;
  expect_identical(options, true);
}

TEST_P(Trajectory, MatchesStockAndPassesVerify) {
  SceneWorldOptions options;
  options.dispatch.minimum_batch = 0;
  options.dispatch.verify = true;
  options.share_shapes = false;
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  SceneWorld world(scenes::make(GetParam().scene, {.spheres = GetParam().spheres, .seed = seed}),
                   options);
  for (int step = 0; step < GetParam().steps; ++step) world.step();
  const DispatchStats& stats = world.jfpx_dispatcher()->stats();
  EXPECT_GT(stats.verified, 0u);
  EXPECT_EQ(stats.mismatches, 0u) << stats.first_mismatch;
}

INSTANTIATE_TEST_SUITE_P(Scenes, Trajectory,
                         ::testing::Values(Case{"pile", 512, 150}, Case{"gas", 512, 120},
                                           Case{"columns", 256, 120}, Case{"overlap", 64, 120},
                                           Case{"boxes-and-balls", 200, 150},
                                           Case{"lattice", 216, 100},
                                           Case{"polydisperse", 300, 100}),
                         [](const auto& tested) {
                           std::string name = tested.param.scene;
                           std::erase(name, '-');
                           return name;
                         });

TEST(TrajectoryOfManyBodies, MatchesStock) {
  // Enough to grow every table several times, and to overflow Bullet's pools of 4096.
  const Scene scene = scenes::make("pile", {.spheres = 3000, .seed = 7});
  SceneWorld stock(scene, {.dispatcher = DispatcherKind::stock});
  SceneWorld ours(scene);
  for (std::uint64_t step = 1; step <= 60; ++step) {
    stock.step();
    ours.step();
    const auto difference = first_difference(stock.world(), ours.world(), step);
    ASSERT_FALSE(difference) << to_text(*difference);
  }
  EXPECT_EQ(ours.jfpx_dispatcher()->stats().batches, 60u);
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
