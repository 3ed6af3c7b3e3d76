/// Heaps of many bodies: penetration, rest and sleep.
#include "tests/world/quality.hpp"

namespace jfpx {
namespace {

TEST(Heaps, APileComesToRestWithSmallPenetrations) {
  constexpr double kRadius = 0.5;
  World world(scenes::make("pile", {.spheres = 2048}));
  test::run(&world, 10);
  const test::Penetration depth = test::penetration(world);
  EXPECT_LE(depth.mean, 0.01 * kRadius);
  EXPECT_LE(depth.largest, 0.06 * kRadius);
  EXPECT_LE(test::speeds(world).rms, 0.002);
  std::uint32_t awake = 0;
  while (world.time() < 15) awake = world.step().awake;
  // Nothing brakes a ball that rolls or spins on the floor beside the heap.
  EXPECT_LE(awake, 2u);
}

TEST(Heaps, BodiesThatOverlapAtTheStartArePushedApartAndDoNotExplode) {
  World world(test::awake(scenes::make("columns", {.spheres = 256})));
  const auto push_out = static_cast<double>(world.scene().soft_step.push_out_speed);
  for (int n = 0; n < 300; ++n) {
    world.step();
    ASSERT_LE(test::speeds(world).largest, push_out + test::kGravity * world.time()) << n;
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
