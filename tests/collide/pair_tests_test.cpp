/// Pair tests have the host's bits on the device; without one, it is enough that they compile.
#include "tests/collide/pair_tests.hpp"

#include <jfpx/backend.hpp>

#include "tests/world/support.hpp"

#include <gtest/gtest.h>

namespace jfpx {
namespace {

TEST(PairTestsOnTheDevice, HaveTheBitsOfTheHost) {
  for (const BackendStatus& backend : available_backends()) {
    if (backend.backend == Backend::cuda && !backend.usable) GTEST_SKIP() << backend.reason;
  }
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  const test::PairTestRun run = test::run_pair_tests(seed, 100000);
  ASSERT_EQ(run.failure, "");
  EXPECT_EQ(run.differences, 0);
  EXPECT_GT(run.touching_boxes, 10000);
}

}  // namespace
}  // namespace jfpx
