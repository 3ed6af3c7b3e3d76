/// Heaps of many bodies: penetration, rest and sleep.
#include "tests/world/quality.hpp"

#include <algorithm>
#include <cmath>

namespace jfpx {
namespace {

TEST(Heaps, AHeapComesToRestWithSmallPenetrationsAndSleeps) {
  World world(scenes::make("heap", {.spheres = 2048}));
  test::expect_heap_comes_to_rest(&world);
}

// Otherwise a ball that keeps touching a heap, however slowly, would keep it awake for ever.
TEST(Heaps, ABodyThatASlowOneTouchesKeepsItsRestTime) {
  Scene scene;
  scene.bodies = {test::heavy_ball({0, 1, 0}, 1), test::ground()};
  World world(scene);
  EXPECT_LT(test::time_to_sleep(&world, 3), 3);
  const double added = world.time();
  const BodyId resting = world.bodies()[0];
  BodyDef slow = test::heavy_ball({Real(-2.008), 1, 0}, 1);
  slow.velocity.x = Real(0.04);  // below SleepSettings::speed; touches after 0.2 s
  slow.friction = 0;
  world.add(slow);
  EXPECT_LT(test::time_to_sleep(&world, added + 3), added + 0.6);
  EXPECT_GT(world.state(resting).position.x, 0.0001);  // it was pushed
}

// Each hit alone leaves the heavy ball slower than SleepSettings::speed.
TEST(Heaps, ASleepingBodyGainsTheVelocityOfManySmallHits) {
  Scene scene;
  BodyDef heavy = test::heavy_ball({0, 1, 0}, 1, 100);
  heavy.friction = 0;
  heavy.restitution = 1;
  scene.bodies = {heavy, test::ground()};
  World world(scene);
  EXPECT_LT(test::time_to_sleep(&world, 3), 3);
  const BodyId target = world.bodies()[0];
  for (int hit = 0; hit < 5; ++hit) {
    BodyDef light = test::heavy_ball({Real(-1.6), 1, 0}, Real(0.5));
    light.acceleration = {};
    light.velocity.x = 2;
    light.friction = 0;
    light.restitution = 1;
    const BodyId added = world.add(light);
    for (int n = 0; n < 6; ++n) world.step();
    EXPECT_LT(world.state(added).velocity.x, -1);  // it rebounds: its removal wakes no other body
    world.remove(added);
  }
  EXPECT_GT(world.state(target).velocity.x, 0.1);
}

TEST(Heaps, BodiesThatOverlapAtTheStartArePushedApartAndDoNotExplode) {
  const Scene scene = test::awake(scenes::make("columns", {.spheres = 256}));
  World world(scene);
  double height = 0;
  for (const BodyDef& def : scene.bodies) {
    height = std::max(height, static_cast<double>(def.position.y));
  }
  const auto push_out = static_cast<double>(scene.soft_step.push_out_speed);
  const double fallen = std::sqrt(push_out * push_out + 2 * test::kGravity * height);
  for (int n = 0; n < 300; ++n) {
    world.step();
    ASSERT_LE(test::speeds(world).largest,
              std::min(push_out + test::kGravity * world.time(), fallen))
        << n;
  }
  EXPECT_LE(test::penetration(world).largest, 0.01);
}

TEST(Heaps, SmallSpheresCarryAGiant) {
  World world(scenes::make("giant", {.spheres = 800}));
  test::run(&world, 2);
  // Not on the floor, but on at least one layer of them, each of which carries 80 times its weight.
  EXPECT_GT(static_cast<double>(world.states()[799].position.y), 20.2);
  EXPECT_LE(test::penetration(world).largest, 0.02);
}

}  // namespace
}  // namespace jfpx
