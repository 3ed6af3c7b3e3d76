/// Tests of the division of rows among threads.
#include "src/contact_solver/soft_step/cpu/grouped_rows.hpp"

#include "tests/support/seed.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace jfpx {
namespace {

using namespace soft_step;  // NOLINT: the namespace under test
using GroupsOfRows = GroupedRows<std::uint32_t>;

/// Rows of random bodies in three groups: many, a few and none.
struct RandomRows {
  RandomRows(std::uint32_t body_count, std::uint32_t row_count, std::mt19937* random)
      : bodies(body_count) {
    std::uniform_int_distribution<std::uint32_t> body(0, bodies - 1);
    GroupCounts counts{};
    counts[1] = row_count, counts[2] = row_count / 20, counts[kFixedGroup] = 5;
    rows.start(counts, kGroupsOfTest, bodies);
    for (std::size_t group = 0; group < kGroupsOfTest; ++group) {
      std::vector<std::uint32_t> sorted(rows.size(group));
      for (std::uint32_t& b : sorted) b = body(*random);
      std::ranges::sort(sorted);
      body_of_row.insert(body_of_row.end(), sorted.begin(), sorted.end());
    }
    // In any order, as threads do it.
    std::vector<std::uint32_t> order(body_of_row.size());
    for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
    std::ranges::shuffle(order, *random);
    for (const std::uint32_t row : order) {
      const std::size_t group = row < rows.end(1) ? 1 : 2;
      rows.place(group, row, 1000 + row, body_of_row[row]);
    }
    rows.finish();
  }

  static constexpr std::size_t kGroupsOfTest = 4;
  std::uint32_t bodies;
  GroupsOfRows rows;
  std::vector<std::uint32_t> body_of_row;
};

TEST(GroupedRows, DividesEveryGroupAtTheSameBodies) {
  const test::Seed seed;
  std::mt19937 random(seed);
  constexpr std::uint32_t kBlock = kBodiesPerBlock;
  for (const std::uint32_t bodies : {1u, kBlock - 1, kBlock, kBlock + 1, 10 * kBlock + 3}) {
    for (const std::uint32_t count : {1u, 7u, 8u, 100u, 3000u}) {
      const RandomRows r(bodies, count, &random);
      for (std::uint32_t row = 0; row < r.body_of_row.size(); ++row) {
        ASSERT_EQ(r.rows.contacts[row], 1000 + row);
      }
      const std::size_t blocks = block_count(bodies);
      for (std::size_t group = 0; group < RandomRows::kGroupsOfTest; ++group) {
        EXPECT_EQ(r.rows.begin(group, 0), r.rows.begin(group));
        EXPECT_EQ(r.rows.begin(group, blocks), r.rows.end(group));
        for (std::size_t block = 0; block < blocks; ++block) {
          const std::uint32_t first = r.rows.begin(group, block);
          const std::uint32_t last = r.rows.begin(group, block + 1);
          ASSERT_LE(first, last);
          // Up to the rest of a vector, the rows of the block.
          for (std::uint32_t row = first; row < last; ++row) {
            ASSERT_LE(r.body_of_row[row] / kBlock, block);
            if (row >= first + 7) {
              ASSERT_EQ(r.body_of_row[row] / kBlock, block);
            }
          }
        }
      }
    }
  }
}

TEST(GroupedRows, HasNoBlocksOfFixedRowsOnly) {
  GroupsOfRows rows;
  GroupCounts counts{};
  counts[kFixedGroup] = 9;
  rows.start(counts, 1, 1000);
  rows.finish();
  EXPECT_EQ(rows.size(), 9u);
  for (std::size_t block = 0; block <= 8; ++block) EXPECT_EQ(rows.begin(0, block), 0u);
  rows.start({}, 0, 0);  // a world without bodies
  rows.finish();
  EXPECT_EQ(rows.size(), 0u);
}

}  // namespace
}  // namespace jfpx
