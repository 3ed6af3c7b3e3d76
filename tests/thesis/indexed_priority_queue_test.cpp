/// Tests of the tournament tree against a linear scan.
#include "src/thesis/indexed_priority_queue.hpp"

#include "tests/thesis/linear_scan.hpp"
#include "tests/world/support.hpp"

#include <gtest/gtest.h>

namespace jfpx {
namespace {

TEST(IndexedPriorityQueue, SelectsTheSameAsALinearScan) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  IndexedPriorityQueue queue;
  test::LinearScan scan;
  for (const std::uint32_t n : {1u, 2u, 15u, 16u, 17u, 100u, 255u, 256u, 257u, 4095u, 4097u, 3u}) {
    // Few different keys, so that ties are common.
    const auto any_key = [&] { return static_cast<Real>(random.below(n)) - 2; };
    std::vector<Real> keys(n);
    for (Real& key : keys) key = any_key();
    queue.assign(keys);
    scan.assign(keys);
    for (int i = 0; i < 1000; ++i) {
      ASSERT_EQ(queue.top(), scan.top()) << "n " << n << ", change " << i;
      const auto number = static_cast<std::uint32_t>(random.below(n));
      const Real key = any_key();
      queue.update(random.below(2) != 0 ? queue.top() : number, key);
      for (std::uint32_t k = 0; k < n; ++k) scan.update(k, queue.key(k));
    }
  }
}

TEST(IndexedPriorityQueue, GivesTiesToTheLowestNumber) {
  IndexedPriorityQueue queue;
  queue.assign(std::vector<Real>(5, Real(1)));
  for (const std::uint32_t expected : {0u, 1u, 2u, 3u, 4u}) {
    EXPECT_EQ(queue.top(), expected);
    queue.update(queue.top(), 0);
  }
  EXPECT_EQ(queue.top(), 0u);
}

}  // namespace
}  // namespace jfpx
