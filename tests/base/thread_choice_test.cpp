/// One thread or several: what is cheaper is found, kept, and left when it no longer is.
#include "src/base/thread_choice.hpp"

#include "tests/support/sphere_fixtures.hpp"

#include <gtest/gtest.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

/// Does `jobs` jobs; returns what they cost on average.
double work(ThreadChoice* choice, int jobs, double alone, double together) {
  double sum = 0;
  for (int i = 0; i < jobs; ++i) {
    const double cost = choice->several() ? together : alone;
    choice->record(cost);
    sum += cost;
  }
  return sum / jobs;
}

TEST(ThreadChoice, CostsLittleMoreThanTheCheaperWay) {
  for (const double together : {0.5, 0.8, 1.3, 4.0}) {
    ThreadChoice choice;
    EXPECT_LT(work(&choice, 2000, 1, together), 1.06 * std::min(1.0, together)) << together;
    EXPECT_LT(work(&choice, 20'000, 1, together), 1.01 * std::min(1.0, together)) << together;
  }
}

TEST(ThreadChoice, NoticesWhenTheOtherWayHasBecomeCheaper) {
  ThreadChoice choice;
  work(&choice, 100'000, 1, 2);
  ASSERT_FALSE(choice.several());
  work(&choice, 4200, 1, 0.5);
  EXPECT_LT(work(&choice, 1000, 1, 0.5), 0.55);
}

TEST(ThreadChoice, IsNotMovedByANoisyClock) {
  Random random(test::base_seed());
  ThreadChoice choice;
  int alone = 0;
  for (int i = 0; i < 20'000; ++i) {
    alone += choice.several() ? 0 : 1;
    // Work of equal cost by a clock that errs by some hundredths, and sometimes by a lot.
    choice.record(1 + 0.0005 * static_cast<double>(random.below(100)) +
                  (random.below(100) == 0 ? 5 : 0));
  }
  EXPECT_LT(alone, 100) << "nothing but trials; " << test::seed_note();
}

}  // namespace
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
