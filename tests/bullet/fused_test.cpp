/// Programs whose compiler fuses products and sums get a warning in the statistics.
#include "tests/bullet/fused_unit.hpp"

#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>
#include <gtest/gtest.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

TEST(FusedProducts, AreAbsentFromAProgramForTheBaseline) {
  btDefaultCollisionConfiguration configuration;
  EXPECT_FALSE(fuses_products());
  EXPECT_EQ(CollisionDispatcher(&configuration).stats().warning, "");
  EXPECT_EQ(CollisionDispatcher(&configuration, make_sphere_collider()).stats().warning, "");
  EXPECT_EQ(SceneWorld(Scene{}).jfpx_dispatcher()->stats().warning, "");
}

TEST(FusedProducts, AreDetectedAndReported) {
#if defined(__x86_64__)
  if (!__builtin_cpu_supports("fma")) GTEST_SKIP() << "this processor has no FMA";
#endif
  btDefaultCollisionConfiguration configuration;
  const auto dispatcher = FusedUnit::dispatcher(&configuration, {});
  EXPECT_NE(dispatcher->stats().warning.find("-ffp-contract=off"), std::string::npos);
  dispatcher->reset_stats();
  EXPECT_NE(dispatcher->stats().warning, "") << "the warning remains true";
  EXPECT_NE(FusedUnit::dispatcher(&configuration, make_sphere_collider(), {})->stats().warning, "");
  EXPECT_NE(FusedUnit::scene_world(Scene{}, {})->jfpx_dispatcher()->stats().warning, "");
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
