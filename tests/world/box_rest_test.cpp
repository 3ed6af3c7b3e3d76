/// Boxes come to rest: towers, columns and heaps, and the contacts that they keep from step to
/// step.
#include <jfpx/collide.hpp>

#include "tests/world/quality.hpp"
#include "tests/world/random_bodies.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace jfpx {
namespace {

using test::operator""_r;

constexpr Vec3 kCube{0.5_r, 0.5_r, 0.5_r};

BodyDef fixed_box(const Vec3& position, const Vec3& half_extents) {
  return test::crate(position, half_extents, 0);
}
Scene on_a_floor() {
  Scene scene;
  scene.bodies = {fixed_box({0, -1, 0}, {100, 1, 100})};
  return scene;
}

/// Boxes above each other with random horizontal offsets.
Scene column(int boxes, Real offset, Real gap, std::uint64_t seed) {
  Scene scene = on_a_floor();
  Random random(seed);
  for (int i = 0; i < boxes; ++i) {
    const Vec3 beside = random.uniform_in_box({-offset, 0, -offset}, {offset, 0, offset});
    const Real height = (0.5_r + static_cast<Real>(i)) * (1 + gap);
    scene.bodies.push_back(test::crate(beside + Vec3{0, height, 0}, kCube));
  }
  return scene;
}

/// Boxes of any orientation that fall into a pit.
Scene tumbled(int boxes, bool of_any_size, std::uint64_t seed) {
  constexpr int kSide = 4;
  constexpr Real kRadius = 3.6_r;
  Scene scene = on_a_floor();
  for (const Real side : {-1._r, 1._r}) {
    scene.bodies.push_back(fixed_box({side * (kRadius + 1), 40, 0}, {1, 40, kRadius + 2}));
    scene.bodies.push_back(fixed_box({0, 40, side * (kRadius + 1)}, {kRadius + 2, 40, 1}));
  }
  Random random(seed);
  for (int i = 0; i < boxes; ++i) {
    const Vec3 size = of_any_size ? random.uniform_in_box({0.2_r, 0.2_r, 0.2_r}, kCube) : kCube;
    const Vec3 at{(static_cast<Real>(i % kSide) - 1.5_r) * 1.75_r,
                  1.5_r + static_cast<Real>(i / kSide / kSide) * 1.8_r,
                  (static_cast<Real>(i / kSide % kSide) - 1.5_r) * 1.75_r};
    BodyDef def = test::crate(at, size, 8 * size.x * size.y * size.z);
    def.friction = 0.6_r;
    def.orientation = test::random_rotation(&random);
    scene.bodies.push_back(def);
  }
  return scene;
}

TEST(Boxes, TowersOf30And50StandForAMinute) {
  for (const int boxes : {30, 50}) {
    World world(test::awake(column(boxes, 0, 0, 1)));
    test::run(&world, 3);
    const std::vector<BodyState> settled = test::states_of(world);
    test::run(&world, 57);
    EXPECT_LT(test::drift(world, settled), 0.15) << boxes;
  }
}

TEST(Boxes, ColumnsWithOffsetsFallAsleep) {
  for (const int boxes : {3, 5, 8, 10}) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      World world(column(boxes, 0.08_r, 0.1_r, seed));
      EXPECT_LT(test::time_to_sleep(&world, 30), 30) << boxes << ", seed " << seed;
      EXPECT_GT(static_cast<double>(world.states().back().position.y), boxes - 0.6) << boxes;
    }
  }
}

TEST(Boxes, HeapsFallAsleepWithSmallPenetrations) {
  for (const bool of_any_size : {false, true}) {
    for (const std::uint64_t seed : {1u, 2u, 3u}) {
      World world(tumbled(100, of_any_size, seed));
      EXPECT_LT(test::time_to_sleep(&world, 40), 40) << of_any_size << seed;
      EXPECT_LT(test::penetration(world).largest, 0.03);
    }
  }
}

// Contacts that are kept from the last step have errors below the margin of two boxes, 2 cm.
TEST(Boxes, KeptContactsFindEveryOverlapAboveTheMargin) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  const Scene scene = tumbled(60, true, seed);
  World world(test::awake(scene));
  const std::vector<BodyId> ids(world.bodies().begin(), world.bodies().end());
  double deepest = 0;
  for (int step = 0; step < 300; ++step) {
    const std::vector<BodyState> states = test::states_of(world);
    world.step();
    std::map<std::pair<std::uint32_t, std::uint32_t>, Real> found;
    for (const Contact& contact : world.contacts()) {
      Real& distance = found[std::minmax(contact.a.index, contact.b.index)];
      distance = std::min(distance, contact.distance);
    }
    for (std::size_t i = 0; i < ids.size(); ++i) {
      for (std::size_t j = i + 1; j < ids.size(); ++j) {
        if (scene.bodies[i].mass == 0 && scene.bodies[j].mass == 0) continue;
        const auto pose = [&](std::size_t k) {
          return make_transform(states[k].orientation, states[k].position);
        };
        const Manifold exact = collide(std::get<Box>(scene.bodies[i].shape), pose(i),
                                       std::get<Box>(scene.bodies[j].shape), pose(j));
        if (exact.count == 0 || exact.distance > -0.021_r) continue;
        deepest = std::max(deepest, static_cast<double>(-exact.distance));
        const auto kept = found.find(std::minmax(ids[i].index, ids[j].index));
        ASSERT_NE(kept, found.end()) << step << ": " << i << ", " << j << " " << exact.distance;
        ASSERT_LT(kept->second, exact.distance + 0.021_r);
      }
    }
  }
  EXPECT_GT(deepest, 0.021);
}

TEST(Boxes, SnapshotsContainTheKeptContacts) {
  World world(test::awake(scenes::make("wall")));
  test::run(&world, 2);
  const Snapshot snapshot = world.snapshot();
  EXPECT_EQ(snapshot.bytes[8], std::byte{4});
  World other(Scene{});
  other.restore(snapshot);
  for (int step = 0; step < 60; ++step) {
    world.step();
    other.step();
    ASSERT_EQ(world.state_hash(), other.state_hash()) << step;
  }
}

TEST(Boxes, StayOnATurntable) {
  for (const Real speed : {0.05_r, 0.2_r}) {
    Scene scene;
    BodyDef table = fixed_box({0, -0.5_r, 0}, {20, 0.5_r, 20});
    table.kinematic = true;
    table.angular_velocity = {0, speed, 0};
    table.friction = 2;
    scene.bodies = {table};
    for (int i = 0; i < 3; ++i) {  // a stack, and a box beside it
      const Vec3 at{i < 2 ? 5._r : 6._r, i == 1 ? 1.5_r : 0.5_r, 0};
      BodyDef box = test::crate(at, kCube);
      box.velocity = {0, 0, -at.x * speed};
      box.angular_velocity = {0, speed, 0};
      box.friction = 2;
      scene.bodies.push_back(box);
    }
    World world(scene);
    test::run(&world, 6.2832 / static_cast<double>(speed));
    for (std::size_t i = 1; i < 4; ++i) {
      const Vec3 at = world.states()[i].position, start = scene.bodies[i].position;
      EXPECT_NEAR(static_cast<double>(length(Vec3{at.x, 0, at.z})), static_cast<double>(start.x),
                  0.1)
          << speed << ", box " << i;
    }
  }
}

// The pressure is equal at the four corners, whose distance from the axis is 1/sqrt(2).
TEST(Boxes, FrictionStopsASpinWithTheAnalyticDeceleration) {
  Scene scene = on_a_floor();
  BodyDef def = test::crate({0, 0.5_r, 0}, kCube);
  def.friction = 0.3_r;
  def.angular_velocity = {0, 5, 0};
  scene.bodies.front().friction = 0.3_r;
  scene.bodies.push_back(def);
  World world(test::awake(scene));
  constexpr double kSeconds = 0.2;
  test::run(&world, kSeconds);
  const double deceleration = 0.3 * test::kGravity / std::numbers::sqrt2 * 6;  // inertia 1/6
  EXPECT_NEAR(static_cast<double>(world.states().back().angular_velocity.y),
              5 - deceleration * kSeconds, 0.05);
}

}  // namespace
}  // namespace jfpx
