/// The items of the dataflows of a device: each row and each body has one, and the rows of a warp
/// are independent.
#include "src/world/device/warp_items.hpp"

#include <jfpx/random.hpp>

#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

namespace jfpx {
namespace {

using device::ColoredRows;
using device::kNone;
using device::WarpItems;

/// The threads of a block, as one thread.
struct OneThread {
  void sync() const {}
  template <class F>
  void once(const F& f) const {
    f();
  }
  template <class F>
  void for_each(std::uint32_t n, const F& f) const {
    for (std::uint32_t i = 0; i < n; ++i) f(i);
  }
  std::uint32_t scan(std::uint32_t n, std::uint32_t* numbers) const {
    const std::uint32_t sum = std::accumulate(numbers, numbers + n, 0u);
    std::exclusive_scan(numbers, numbers + n, numbers, 0u);
    return sum;
  }
};

TEST(WarpItems, EachBodyHasOneItem) {
  for (const std::uint32_t n : {0u, 1u, 5u, 17u, 31u, 32u, 33u, 65u, 1000u}) {
    for (const std::uint32_t warps : {1u, 2u, 7u, 8u, 40u, 2000u}) {
      const WarpItems items(n, warps, 0, WarpItems::kLog2OfLanes);
      EXPECT_EQ(items.items(n) % WarpItems::kLanes, 0u);
      if (n <= warps * WarpItems::kLanes) {
        EXPECT_LE(items.items(n), warps * WarpItems::kLanes);
      }
      std::vector<std::uint32_t> found;
      for (std::uint32_t i = 0; i < items.items(n); ++i) {
        if (const std::uint32_t number = items.find(i, n); number != kNone) found.push_back(number);
      }
      std::vector<std::uint32_t> all(n);
      std::iota(all.begin(), all.end(), 0u);
      EXPECT_EQ(found, all) << n << " bodies, " << warps << " warps";
    }
  }
}

TEST(WarpItems, AWarpHasAsFewAsTheNumberOfWarpsPermits) {
  const std::uint32_t n = 100, warps = 30;
  EXPECT_EQ(WarpItems(n, warps, 0, 5).items(n), 25 * WarpItems::kLanes);  // four for each warp
  EXPECT_EQ(WarpItems(n, warps, 3, 5).items(n), 13 * WarpItems::kLanes);
  EXPECT_EQ(WarpItems(n, warps, 0, 1).items(n), 50 * WarpItems::kLanes);
}

TEST(ColoredRows, TheItemsAreTheRowsOfTheColorsInSweepOrder) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (int round = 0; round < 200; ++round) {
    device::RowBins bins{};
    // Few bins have rows in most worlds, and a bin may have a single one.
    const std::uint64_t odds = 1 + random.below(20), most = 1 + random.below(200);
    for (std::uint32_t bin = 0; bin < device::kBins; ++bin) {
      const auto rows =
          random.below(odds) == 0 ? static_cast<std::uint32_t>(random.below(most)) : 0u;
      bins.begin[bin + 1] = bins.begin[bin] + rows;
    }
    ColoredRows rows;
    rows.start(OneThread(), bins, 1 + static_cast<std::uint32_t>(random.below(2200)));
    ASSERT_EQ(rows.items() % WarpItems::kLanes, 0u);

    std::vector<std::uint32_t> expected, found;
    for (std::uint32_t color = 0; color < soft_step::kColorsPerClass; ++color) {
      for (std::uint32_t kind = 0; kind < soft_step::kRowKinds; ++kind) {
        const std::uint32_t bin = soft_step::bin_of(kind, soft_step::group_of_crossing(color));
        for (std::uint32_t row = bins.begin[bin]; row < bins.begin[bin + 1]; ++row) {
          expected.push_back(row);
        }
      }
    }
    for (std::uint32_t warp = 0; warp < rows.items(); warp += WarpItems::kLanes) {
      std::vector<std::uint32_t> bins_of_warp;
      for (std::uint32_t i = warp; i < warp + WarpItems::kLanes; ++i) {
        const auto [row, color] = rows.find(i);
        if (row == kNone) continue;
        found.push_back(row);
        const auto* after = std::upper_bound(bins.begin, bins.begin + device::kBins, row);
        const auto bin = static_cast<std::uint32_t>(after - bins.begin - 1);
        EXPECT_EQ(bin % soft_step::kGroups, soft_step::group_of_crossing(color));
        bins_of_warp.push_back(bin);
      }
      ASSERT_FALSE(bins_of_warp.empty());
      EXPECT_EQ(std::ranges::count(bins_of_warp, bins_of_warp[0]),
                static_cast<std::ptrdiff_t>(bins_of_warp.size()));
      if (bins_of_warp[0] / soft_step::kGroups != soft_step::kKindOf<soft_step::SphereRow>) {
        EXPECT_LE(bins_of_warp.size(), 4u);
      }
    }
    ASSERT_EQ(found, expected);
  }
}

TEST(ColoredRows, AWarpHasAtLeastEightRowsOfSpheres) {
  for (const std::uint32_t n : {8u, 9u}) {
    device::RowBins bins{};
    const std::uint32_t bin = soft_step::bin_of(soft_step::kKindOf<soft_step::SphereRow>,
                                                soft_step::group_of_crossing(3));
    std::fill(bins.begin + bin + 1, bins.begin + device::kBins + 1, n);
    ColoredRows rows;
    rows.start(OneThread(), bins, 1000);
    EXPECT_EQ(rows.items(), (n == 8 ? 1 : 2) * WarpItems::kLanes);
  }
}

}  // namespace
}  // namespace jfpx
