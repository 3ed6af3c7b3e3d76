/// The parallel sort has the permutation of Bullet's sort, which is not stable.
#include "src/bullet/world/parallel_quick_sort.hpp"

#include "tests/bullet/twin_worlds.hpp"

#include <LinearMath/btAlignedObjectArray.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

struct Item {
  int key, index;
};
constexpr auto kLess = [](const Item& a, const Item& b) { return a.key < b.key; };

TEST(ParallelQuickSort, HasThePermutationOfBulletsSort) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  for (const unsigned threads : {1u, 2u, 5u, 64u}) {
    ThreadPool pool(threads);
    for (const std::uint64_t keys : {1u, 2u, 50u, 1000000u}) {
      for (const int count : {0, 1, 2, 3, 8191, 8192, 60000}) {
        btAlignedObjectArray<Item> stock;
        std::vector<Item> ours;
        const bool ascending = random.below(3) == 0;
        for (int i = 0; i < count; ++i) {
          ours.push_back({ascending ? i / 7 : static_cast<int>(random.below(keys)), i});
          stock.push_back(ours.back());
        }
        stock.quickSort(kLess);
        parallel_quick_sort(pool, std::span(ours), kLess);
        for (int i = 0; i < count; ++i) {
          ASSERT_EQ(stock[i].index, ours[static_cast<std::size_t>(i)].index)
              << threads << " threads, " << keys << " keys, item " << i << " of " << count;
        }
      }
    }
  }
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
