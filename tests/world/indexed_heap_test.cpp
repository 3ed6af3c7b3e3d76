/// The heap against a scan from the front.
#include "src/indexed_heap.hpp"

#include "tests/world/linear_scan.hpp"
#include "tests/world/support.hpp"

#include <gtest/gtest.h>

namespace jfpx {
namespace {

TEST(IndexedHeap, PicksWhatALinearScanPicks) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  IndexedHeap heap;
  test::LinearScan scan;
  for (const std::uint32_t n : {1u, 2u, 3u, 4u, 7u, 8u, 9u, 100u, 1000u}) {
    // Few different keys, so that ties are common.
    const auto any_key = [&] { return static_cast<Real>(random.below(n)) - 2; };
    std::vector<Real> keys(n);
    for (Real& key : keys) key = any_key();
    heap.assign(keys);
    scan.assign(keys);
    for (int i = 0; i < 2000; ++i) {
      ASSERT_EQ(heap.top(), scan.top()) << "n " << n << ", change " << i;
      const auto number = static_cast<std::uint32_t>(random.below(n));
      const Real key = any_key();
      heap.update(random.below(2) != 0 ? heap.top() : number, key);
      for (std::uint32_t k = 0; k < n; ++k) scan.update(k, heap.key(k));
    }
  }
}

TEST(IndexedHeap, GivesTiesToTheLowestNumber) {
  IndexedHeap heap;
  heap.assign(std::vector<Real>(5, Real(1)));
  for (const std::uint32_t expected : {0u, 1u, 2u, 3u, 4u}) {
    EXPECT_EQ(heap.top(), expected);
    heap.update(heap.top(), 0);
  }
  EXPECT_EQ(heap.top(), 0u);
}

}  // namespace
}  // namespace jfpx
