/// Tests of the greedy coloring of contacts.
#include "src/contact_solver/soft_step/greedy_coloring.hpp"

#include "tests/support/seed.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <initializer_list>
#include <numeric>
#include <random>
#include <tuple>

namespace jfpx {
namespace {

using namespace soft_step;  // NOLINT: the namespace under test

TEST(GreedyColoring, TakesTheLowestFreeColorOfAClass) {
  EXPECT_EQ(kOverflowColor, 64);  // as in snapshots of 0.2
  for (const bool is_inner : {true, false}) {
    const unsigned first = is_inner ? 0 : kFirstCrossingColor;
    UsedColors a, b, full;
    EXPECT_EQ(take_lowest_color(is_inner, &a, &b), first);
    EXPECT_EQ(take_lowest_color(is_inner, &a, &b), first + 1);
    EXPECT_EQ(a.of_class(is_inner), 3u);
    EXPECT_EQ(b.of_class(is_inner), 3u);
    EXPECT_EQ(a.of_class(!is_inner), 0u);
    full.of_class(is_inner) = ~std::uint64_t{0};
    EXPECT_EQ(take_lowest_color(is_inner, &full, &b), kOverflowColor);
    for (unsigned number = 0; number < kColorsPerClass; ++number) {
      UsedColors one;
      one.of_class(is_inner) = ~(std::uint64_t{1} << number);
      UsedColors other;
      EXPECT_EQ(take_lowest_color(is_inner, &one, &other), first + number);
    }
  }
}

/// One contact after the other, in the order of the hash of its key. Contacts whose bodies are both
/// below `block` are inner.
std::vector<std::uint8_t> colored_one_by_one(const std::vector<ContactKey>& keys,
                                             std::uint32_t bodies, std::uint32_t block) {
  std::vector<std::uint32_t> order(keys.size());
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::sort(order, {},
                    [&](std::uint32_t i) { return std::tuple(color_order(keys[i]), i); });
  std::vector<std::vector<bool>> used(bodies, std::vector<bool>(256, false));
  std::vector<std::uint8_t> colors(keys.size());
  for (const std::uint32_t i : order) {
    const bool is_inner = keys[i].a < block && keys[i].b < block;
    std::uint8_t color = is_inner ? 0 : kFirstCrossingColor;
    const std::uint8_t end = color + kColorsPerClass;
    while (color < end && (used[keys[i].a][color] || used[keys[i].b][color])) ++color;
    colors[i] = color < end ? color : kOverflowColor;
    if (color < end) used[keys[i].a][color] = used[keys[i].b][color] = true;
  }
  return colors;
}

TEST(GreedyColoring, IsThatOfTheSortedContactsForAnyNumberOfThreads) {
  const test::Seed seed;
  std::mt19937 random(seed);
  std::uniform_int_distribution<std::uint32_t> part(0, 1);
  ThreadPool pool(3);
  GreedyColoring coloring;
  for (const std::uint32_t count : {0u, 1u, 63u, 64u, 65u, 256u, 257u, 20000u}) {
    // Body 0 has more contacts than there are colors.
    const std::uint32_t bodies = count / 3 + 2;
    std::uniform_int_distribution<std::uint32_t> body(0, bodies - 1);
    std::vector<ContactKey> keys(count);
    for (ContactKey& key : keys) {
      key = {body(random) < bodies / 50 ? 0 : body(random), body(random), part(random), 0};
      if (key.a == key.b) key.b = (key.a + 1) % bodies;
    }
    const std::vector<std::uint8_t> expected = colored_one_by_one(keys, bodies, bodies / 2);
    for (ThreadPool* const p : {static_cast<ThreadPool*>(nullptr), &pool}) {
      coloring.start(bodies, p, nullptr);
      GreedyColoring::Portion portion(&coloring);
      for (std::uint32_t i = 0; i < count; ++i) {
        portion.add(keys[i], i, keys[i].a < bodies / 2 && keys[i].b < bodies / 2);
      }
      portion.flush();
      std::vector<std::uint8_t> colors(count, kNoColor);
      coloring.finish([&](std::uint32_t i, std::uint8_t color) { colors[i] = color; }, p, nullptr);
      EXPECT_EQ(colors, expected) << count << " contacts";
    }
    if (count == 20000) {
      EXPECT_TRUE(std::ranges::count(expected, kOverflowColor) > 0);
    }
  }
}

}  // namespace
}  // namespace jfpx
