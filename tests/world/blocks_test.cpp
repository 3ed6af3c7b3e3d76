/// Worlds that the solver divides into blocks, and their partition.
#include "src/world/bodies/partition.hpp"
#include "src/world/world_impl.hpp"
#include "tests/world/quality.hpp"
#include "tests/world/several_blocks.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <tuple>
#include <vector>

namespace jfpx {
namespace {

using soft_step::kNoPlace;

const BodyStore& store_of(World& world) { return WorldAccess::impl(world).store; }

std::vector<std::uint32_t> places_of(World& world) {
  std::vector<std::uint32_t> places;
  for (const BodyId id : world.bodies()) places.push_back(store_of(world).moving.place[id.index]);
  return places;
}

/// Whether a point precedes another along the Morton curve: by the axis whose cells differ in the
/// highest bit (Chan 2002), in double precision.
bool precedes(const Vec3& p, const Vec3& q, double cell) {
  const auto cell_of = [&](Real x) {
    return static_cast<std::uint64_t>(
        static_cast<std::int64_t>(std::floor(static_cast<double>(x) / cell)) + (1 << 20));
  };
  int axis = 2;
  std::uint64_t most = 0;
  for (int i = 2; i >= 0; --i) {
    const std::uint64_t bits = cell_of(p[i]) ^ cell_of(q[i]);
    if (most < bits && most < (most ^ bits)) axis = i, most = bits;
  }
  return cell_of(p[axis]) < cell_of(q[axis]);
}

TEST(Partition, OrdersBodiesAlongTheMortonCurve) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  const test::SeveralBlocks several(8);
  for (int round = 0; round < 20; ++round) {
    const Real size = std::exp2(random.uniform(-20, 18));
    Scene scene;
    for (int i = 0; i < 200; ++i) {
      const Real extent = i == 0 ? size : size * Real(0.01);  // one body is far away
      BodyDef def =
          test::ball(random.uniform_in_box({-extent, -extent, -extent}, {extent, extent, extent}),
                     size * Real(1e-6));
      def.acceleration = {};
      if (i % 20 == 7) def.mass = 0;
      scene.bodies.push_back(def);
    }
    World world(scene);
    EXPECT_EQ(places_of(world), std::vector<std::uint32_t>(200, kNoPlace));
    world.step();
    std::vector<std::pair<std::uint32_t, Vec3>> placed;
    double largest = 0;
    for (const BodyId id : world.bodies()) {
      const std::uint32_t place = store_of(world).moving.place[id.index];
      ASSERT_EQ(place == kNoPlace, world.mass(id) == 0);
      if (place == kNoPlace) continue;
      const Vec3 position = world.state(id).position;
      placed.emplace_back(place, position);
      for (int k = 0; k < 3; ++k) {
        largest = std::max(largest, std::fabs(static_cast<double>(position[k])));
      }
    }
    std::ranges::sort(placed, {}, [](const auto& item) { return item.first; });
    const double cell = std::exp2(std::floor(std::log2(largest)) + 1) / (1 << 20);
    for (std::uint32_t k = 0; k < placed.size(); ++k) {
      ASSERT_EQ(placed[k].first, k);
      if (k > 0) {
        ASSERT_FALSE(precedes(placed[k].second, placed[k - 1].second, cell)) << k;
      }
    }
  }
}

TEST(Partition, IsRenewedWhenItIsDueAndABodyIsAwake) {
  EXPECT_TRUE(partition::is_due(0, 1000, 0));
  EXPECT_FALSE(partition::is_due(1, 1000, 125));
  EXPECT_TRUE(partition::is_due(1, 1000, 126));
  EXPECT_TRUE(partition::is_due(128, 1000, 0));
  const test::SeveralBlocks several(8);
  World world(test::awake(scenes::make("lattice", {.spheres = 512})));
  world.step();
  const std::vector<std::uint32_t> first = places_of(world);
  const BodyId added = world.add(test::ball({0, 100, 0}, Real(0.5)));
  for (int n = 1; n < 64; ++n) world.step();
  std::vector<std::uint32_t> places = places_of(world);
  EXPECT_EQ(store_of(world).moving.place[added.index], kNoPlace);
  places.resize(first.size());
  EXPECT_EQ(places, first);
  world.step();
  EXPECT_NE(store_of(world).moving.place[added.index], kNoPlace);
}

TEST(Partition, IsNotUsedBelowTheLimit) {
  World world(scenes::make("lattice", {.spheres = 512}));
  world.step();
  EXPECT_FALSE(store_of(world).has_places());
}

/// Balls, boxes and joined bodies that come and go in a room.
struct RandomRoom {
  explicit RandomRoom(std::uint64_t seed) : random(seed) {}
  Random random;

  BodyDef body() {
    BodyDef def = test::heavy_ball(random.uniform_in_box({-6, 1, -6}, {6, 12, 6}),
                                   random.uniform(Real(0.2), Real(0.5)));
    if (random.below(5) == 0) def.shape = Box{{Real(0.3), Real(0.4), Real(0.5)}};
    def.restitution = random.below(3) == 0 ? Real(0.5) : Real(0);
    def.friction = random.uniform(0, 1);
    if (random.below(9) == 0) def.rolling_friction = Real(0.01);
    return def;
  }
  Scene scene(int bodies) {
    Scene scene;
    for (int i = 0; i < bodies; ++i) scene.bodies.push_back(body());
    scene.bodies.push_back(test::ground());
    for (const Vec3& normal : {Vec3{1, 0, 0}, Vec3{-1, 0, 0}, Vec3{0, 0, 1}, Vec3{0, 0, -1}}) {
      scene.bodies.push_back(test::half_space(normal, -7));
    }
    return scene;
  }
};

TEST(Blocks, HaveTheSameBitsForAllThreadsVectorsAndSnapshots) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  const test::SeveralBlocks several(300);
  RandomRoom room(seed);
  const Scene scene = room.scene(2300);  // three blocks
  const auto make = [&](unsigned threads, SimdLevel simd) {
    return World(scene, {.collider = {.backend = Backend::cpu, .simd = simd}, .threads = threads});
  };
  World a = make(1, SimdLevel::automatic), b = make(3, SimdLevel::scalar);
  for (int n = 0; n < 90; ++n) {
    if (n % 7 == 3) {
      const std::size_t removed = room.random.below(2000);
      const BodyDef def = room.body();
      for (World* world : {&a, &b}) {
        world->remove(world->bodies()[removed]);
        world->add(def);
      }
    }
    a.step(), b.step();
    ASSERT_EQ(a.state_hash(), b.state_hash()) << "step " << n;
    if (n == 40) {
      const Snapshot snapshot = a.snapshot();
      ASSERT_TRUE(snapshot == b.snapshot());
      b.restore(snapshot);
    }
  }
  EXPECT_TRUE(a.snapshot() == b.snapshot());
}

TEST(Blocks, AWorldThatGrowsAndShrinksCrossesTheLimit) {
  const test::SeveralBlocks several(1500);
  RandomRoom room(1);
  World a(room.scene(1400)), b(room.scene(1400));
  b.restore(a.snapshot());
  for (int n = 0; n < 60; ++n) {
    for (int k = 0; k < 10; ++k) {
      const BodyDef def = room.body();
      if (n < 30) a.add(def), b.add(def);
      if (n >= 30) a.remove(a.bodies()[5]), b.remove(b.bodies()[5]);
    }
    a.step(), b.step();
    ASSERT_EQ(store_of(a).has_blocks(), store_of(a).movable_count() > 1500);
    b.restore(a.snapshot());
    ASSERT_EQ(a.state_hash(), b.state_hash());
  }
  EXPECT_TRUE(store_of(a).has_places());
}

// As Heaps.AHeapComesToRestWithSmallPenetrationsAndSleeps, for the other order of rows.
TEST(Blocks, AHeapComesToRestWithSmallPenetrationsAndSleeps) {
  const test::SeveralBlocks several(100);
  World world(scenes::make("heap", {.spheres = 2500}));
  test::expect_heap_comes_to_rest(&world);
}

TEST(Blocks, SnapshotsWithInvalidPlacesAreRefused) {
  const test::SeveralBlocks several(2);
  Scene scene;
  for (int i = 0; i < 4; ++i) {
    scene.bodies.push_back(test::ball({static_cast<Real>(3 * i), 0, 0}, Real(0.5)));
  }
  World world(scene);
  world.step();
  MotionArrays& moving = WorldAccess::impl(world).store.moving;
  World other(scene);
  other.restore(world.snapshot());
  EXPECT_EQ(places_of(other), (std::vector<std::uint32_t>{0, 1, 2, 3}));
  for (const std::uint32_t place : {1u, 4u}) {  // taken twice; too large
    moving.place[0] = place;
    EXPECT_THROW(other.restore(world.snapshot()), InvalidSnapshot) << place;
  }
}

}  // namespace
}  // namespace jfpx
