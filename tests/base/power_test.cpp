/// Tests of detail::power() against std::pow().
#include "src/base/power.hpp"

#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace jfpx {
namespace {

TEST(Power, AgreesWithTheCLibrary) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  std::mt19937_64 engine(seed);
  std::uniform_real_distribution<double> log_base(-40, 0), log_exponent(-20, 3);
  for (int i = 0; i < 100000; ++i) {
    const double base = std::exp(i % 2 == 0 ? log_base(engine) : log_base(engine) / 1000);
    const double exponent = std::exp(log_exponent(engine));
    const double expected = std::pow(base, exponent);
    const double size = 1 + std::abs(exponent * std::log(base));
    if (expected < 1e-300) continue;  // denormal results have fewer digits
    ASSERT_NEAR(detail::power(base, exponent) / expected, 1, 1e-15 * size)
        << base << " ^ " << exponent;
  }
}

TEST(Power, IsExactForBaseOneAndSimpleExponents) {
  for (const double exponent : {1e-300, 1.0 / 60, 1.0, 1e30}) {
    EXPECT_EQ(detail::power(1, exponent), 1);
  }
  EXPECT_EQ(detail::power(0.5, 0), 1);
  EXPECT_EQ(detail::power(0.5, 1), 0.5);
  EXPECT_EQ(detail::power(0.25, 0.5), 0.5);
}

TEST(Power, UnderflowsToZeroForLongTimesAndSmallBases) {
  EXPECT_EQ(detail::power(0.5, 1e6), 0);
  EXPECT_EQ(detail::power(1e-300, 2), 0);
  EXPECT_EQ(detail::power(0.5, std::numeric_limits<double>::max()), 0);
  EXPECT_GT(detail::power(std::numeric_limits<double>::denorm_min(), 0.01), 0);
}

}  // namespace
}  // namespace jfpx
