/// Programs whose compiler fuses products and sums are told.
#include "tests/bullet/fused_unit.hpp"

#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>
#include <gtest/gtest.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

TEST(FusedProducts, OfAProgramForAnyProcessorAreNotThere) {
  btDefaultCollisionConfiguration configuration;
  EXPECT_FALSE(fuses_products());
  EXPECT_EQ(CollisionDispatcher(&configuration).stats().warning, "");
}

TEST(FusedProducts, AreFoundAndSaid) {
  if (!__builtin_cpu_supports("fma")) GTEST_SKIP() << "this processor does not fuse";
  btDefaultCollisionConfiguration configuration;
  CollisionDispatcher dispatcher(&configuration, options_of_fused_unit());
  EXPECT_NE(dispatcher.stats().warning.find("-ffp-contract=off"), std::string::npos);
  dispatcher.reset_stats();
  EXPECT_NE(dispatcher.stats().warning, "") << "what is compiled stays compiled";
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
