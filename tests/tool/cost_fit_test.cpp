/// Estimation of cost model terms, tested against known costs.
#include "src/tool/cost_fit.hpp"

#include <jfpx/random.hpp>

#include "tests/support/sphere_fixtures.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {
namespace {

using Term = double CostTerms::*;
constexpr Term kTerms[] = {&CostTerms::call_us, &CostTerms::sphere_ns, &CostTerms::pair_ns,
                           &CostTerms::contact_ns};

/// Times of a machine with these costs, each with a relative error of up to `noise`.
std::vector<CostSample> times_of(const CostTerms& costs, double noise, Random& random) {
  std::vector<CostSample> samples;
  for (const double n : {32.0, 128.0, 512.0, 2048.0}) {
    for (const double density : {0.0, 3.0, 12.0}) {
      const ColliderWork work = search_work(n, density * n);
      const double error = noise * static_cast<double>(random.uniform(-1, 1));
      samples.push_back({work, microseconds(costs, work) * (1 + error)});
    }
  }
  return samples;
}

CostTerms random_costs(Random& random) {
  const auto up_to = [&](double max) { return max * static_cast<double>(random.uniform()); };
  return {.call_us = up_to(10),
          .byte_ns = 0,
          .sphere_ns = up_to(100),
          .pair_ns = up_to(1),
          .contact_ns = up_to(50)};
}

TEST(CostFit, RecoversTheCostsFromExactTimes) {
  Random random(test::base_seed());
  for (int k = 0; k < 50; ++k) {
    const CostTerms costs = random_costs(random);
    const CostTerms found = fit_costs(times_of(costs, 0, random), kTerms);
    for (const CostSample& s : times_of(costs, 0, random)) {
      EXPECT_NEAR(microseconds(found, s.work) / s.us, 1, 1e-3) << test::seed_note();
    }
  }
}

TEST(CostFit, IsAsAccurateAsTheTimes) {
  Random random(test::base_seed());
  for (int k = 0; k < 50; ++k) {
    const CostTerms costs = random_costs(random);
    const CostTerms found = fit_costs(times_of(costs, 0.1, random), kTerms);
    for (const CostSample& s : times_of(costs, 0, random)) {
      EXPECT_NEAR(microseconds(found, s.work) / s.us, 1, 0.3) << test::seed_note();
    }
  }
}

TEST(CostFit, NoTermIsNegative) {
  // The times decrease: without the constraint the cost of a sphere would be negative.
  const std::vector<CostSample> samples = {{search_work(10, 0), 10}, {search_work(1000, 0), 5}};
  const CostTerms found = fit_costs(samples, kTerms);
  for (const Term term : kTerms) EXPECT_GE(found.*term, 0.0);
  // The best constant minimises (x/10 - 1)^2 + (x/5 - 1)^2: x = (1/10 + 1/5) / (1/100 + 1/25) = 6.
  EXPECT_NEAR(found.call_us, 6, 1e-6);
}

TEST(CostFit, KnownTermsAreKeptAndSubtracted) {
  constexpr Term kCall[] = {&CostTerms::call_us};
  const ColliderWork work = search_work(100, 0);  // 100 spheres of 4 Reals each
  const CostTerms known{.byte_ns = 10};
  const double moved = 10e-3 * 100 * sizeof(SphereInstance);
  const CostTerms found = fit_costs(std::vector<CostSample>{{work, moved + 3}}, kCall, known);
  EXPECT_EQ(found.byte_ns, 10);
  EXPECT_NEAR(found.call_us, 3, 1e-9);
}

TEST(Crossover, IsTheSmallestSizeThatIsFaster) {
  // n(n-1)/2 pairs of 2 ns against 99 ns per sphere: n - 1 > 99, so n >= 101.
  EXPECT_EQ(crossover({.pair_ns = 2}, {.sphere_ns = 99}), 101);
  EXPECT_EQ(crossover({.sphere_ns = 1}, {.sphere_ns = 2}), 0);
  EXPECT_EQ(crossover({.call_us = 1}, {}), 1);
}

}  // namespace
}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
